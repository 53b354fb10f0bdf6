#include <limits>
#include <memory>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/commands/bulk_query.h"
#include "client/cli/commands/query_command.h"
#include "client/cli/failure.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct NearestOptions {
  QueryOptions query;
  BulkOptions bulk;
  std::vector<Triple> at;
  std::vector<double> max_distances;
  uint32_t k = 0;
  v1::StaticDetail detail = v1::STATIC_DETAIL_UNSPECIFIED;
};

// Returns the layout of the report's rows: distance (column T) and id always, then the requested columns.
RowLayout layout_of(const NearestOptions& options) {
  return {
      .query = "query",
      .columns = columns_behind({v1::COLUMN_T, v1::COLUMN_ID}, options.query, {v1::COLUMN_TRIANGLE, v1::COLUMN_POINT})};
}

void apply_to_points(const NearestOptions& options, const RowLayout& layout, const client::Double3& frame,
                     client::NearestBlock& block) {
  apply_to_block(options.query, block);
  block.frame(frame).columns(layout.columns).k(options.k).detail(options.detail);
}

enum NearestField : size_t { kNearestAt, kNearestMaxDistance, kNearestFilter };

absl::Status query_points_of_input(const NearestOptions& options, Context& context) {
  absl::Status checked = check(options.query, options.bulk);
  if (checked.ok() && !options.at.empty()) checked = usage_error("give --at or an input with its columns, not both");
  checked.Update(at_most_one(options.max_distances, "--max-distance"));
  RETURN_IF_ERROR(checked);
  BulkQuery query = {.schema = {}, .layout = layout_of(options), .rows_name = "found", .add_block = {}};
  query.schema = {
      {.name = "at", .kind = FieldKind::kCoordinate, .parts = "xyz", .aliases = {"position"}, .required = true},
      column_or_option({.name = "max_distance", .kind = FieldKind::kDistance}, options.max_distances,
                       "--max-distance")};
  add_filter_fields(options.query, query.schema);
  query.add_block = [&](const BlockRows& rows, client::QueryBuilder& builder) {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    client::NearestBlock block = builder.nearest();
    apply_to_points(options, query.layout, rows.frame, block);
    block.points(rows.offsets);
    block.max_distances(float_column(rows.batch.columns[kNearestMaxDistance], rows.rows, {kInfinity},
                                     floats_of(options.max_distances)));
    apply_filter_columns(options.query, rows, kNearestFilter, block);
  };
  return run_bulk_query(query, options.query, options.bulk, context);
}

absl::Status query_nearest(const NearestOptions& options, Context& context) {
  if (options.bulk.given()) return query_points_of_input(options, context);
  RETURN_IF_ERROR(check(options.bulk));
  if (options.at.empty()) return usage_error("give --at, or rows with --from-csv or --from-ndjson");
  const FramedPositions at = framed(options.at);
  RowLayout layout = layout_of(options);
  layout.frame = at.frame;
  client::QueryBuilder builder;
  client::NearestBlock block = builder.nearest();
  apply_to_points(options, layout, at.frame, block);
  block.points(at.offsets).max_distances(floats_of(options.max_distances));
  return ask_and_report(options.query, builder, layout, "found", context);
}

}  // namespace

void add_query_nearest(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<NearestOptions>();
  CLI::App& command = *parent.add_subcommand("nearest", "Ask what is nearest to points");
  command.footer(R"(Examples:
  locus query nearest arena --at 0,0,0
  locus query nearest arena --at 0,0,0 --k 10 --max-distance 50 --source dynamic --columns group,pose
  locus query nearest arena --at 1,2,3 --k 3 --detail triangles --source static
  locus -o csv query nearest arena --from-csv players.csv --k 5 > around.csv

t is the distance: 0 in an object, to the surface of meshes even inside them. Rows: at.x,at.y,at.z[,max_distance,mask,
ignore_group] or {"at": [0,0,0]}; an option given once stands for a column. All rows are answered at one revision; see
--follow.)");
  add_repeatable(command, "--at", options->at, "X,Y,Z", "Where to measure from; repeat for more points");
  command.add_option("--k", options->k, "How many to find for each [1]")->type_name("K");
  add_repeatable(command, "--max-distance", options->max_distances, "D", "Maximum distance, inclusive [inf]");
  add_detail_option(command, options->detail);
  add_bulk_query_options(command, options->bulk);
  add_query_options(command, options->query);
  run_or_check_when_chosen(command, options, context, query_nearest);
}

}  // namespace locus::cli
