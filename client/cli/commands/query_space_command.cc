#include <memory>
#include <string>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/choices.h"
#include "client/cli/commands.h"
#include "client/cli/commands/bulk_query.h"
#include "client/cli/commands/query_command.h"
#include "client/cli/failure.h"
#include "client/lib/result_rows.h"
#include "core/base/status_macros.h"

// The commands `locus query frustum`, `contains` and `cell`, which query regions and points of space.
namespace locus::cli {
namespace {

struct FrustumOptions {
  QueryOptions query;
  BulkOptions bulk;
  std::vector<Quaternion> planes;
  std::vector<double> matrix;
  v1::ClipDepth clip_depth = v1::CLIP_DEPTH_UNSPECIFIED;
  v1::StaticDetail detail = v1::STATIC_DETAIL_UNSPECIFIED;
};

struct PointOptions {
  QueryOptions query;
  BulkOptions bulk;
  std::vector<Triple> at;
  std::vector<double> max_distances;
  uint32_t max_planes = 0;
};

// Queries the views of cameras that are given as rows of the input, one matrix per row.
absl::Status query_views_of_input(const FrustumOptions& options, Context& context) {
  absl::Status checked = check(options.query, options.bulk);
  if (checked.ok() && (!options.planes.empty() || !options.matrix.empty()))
    checked = usage_error("give --plane, --view or an input with its columns, not both");
  RETURN_IF_ERROR(checked);
  BulkQuery query = {.schema = {{.name = "view", .parts = "0123456789abcdef", .required = true}},
                     .layout = {.query = "frustum", .columns = overlap_columns(options.query, options.detail)},
                     .rows_name = "found",
                     .add_block = {}};
  query.has_position = false;
  add_filter_fields(options.query, query.schema);
  query.add_block = [&](const BlockRows& rows, client::QueryBuilder& builder) {
    client::FrustumBlock block = builder.frustums();
    apply_to_block(options.query, block);
    block.columns(query.layout.columns).detail(options.detail);
    block.view_projections(float_column(rows.batch.columns[0], rows.rows, std::vector<float>(16), {}),
                           options.clip_depth);
    apply_filter_columns(options.query, rows, 1, block);
  };
  return run_bulk_query(query, options.query, options.bulk, context);
}

absl::Status query_frustum(const FrustumOptions& options, Context& context) {
  if (options.bulk.given()) return query_views_of_input(options, context);
  RETURN_IF_ERROR(check(options.bulk));
  if (options.planes.empty() == options.matrix.empty())
    return usage_error("give --plane, --view with 16 numbers, or rows with --from-csv or --from-ndjson");
  const RowLayout layout = {.query = "frustum", .columns = overlap_columns(options.query, options.detail)};
  client::QueryBuilder builder;
  client::FrustumBlock block = builder.frustums();
  apply_to_block(options.query, block);
  block.columns(layout.columns).detail(options.detail);
  if (options.matrix.empty())
    block.planes(floats_of(options.planes), static_cast<uint32_t>(options.planes.size()));
  else
    block.view_projections(floats_of(options.matrix), options.clip_depth);
  return ask_and_report(options.query, builder, layout, "found", context);
}

absl::Status check_input(const PointOptions& options) {
  absl::Status checked = check(options.query, options.bulk);
  if (checked.ok() && !options.at.empty()) checked = usage_error("give --at or an input with its columns, not both");
  checked.Update(at_most_one(options.max_distances, "--max-distance"));
  return checked;
}

RowLayout layout_of_contains(const PointOptions& options) {
  return {.query = "query", .columns = columns_behind({v1::COLUMN_ID}, options.query)};
}

absl::Status query_contains(const PointOptions& options, Context& context) {
  RowLayout layout = layout_of_contains(options);
  if (options.bulk.given()) {
    RETURN_IF_ERROR(check_input(options));
    BulkQuery query = {.schema = {at_field()}, .layout = layout, .rows_name = "found", .add_block = {}};
    add_filter_fields(options.query, query.schema);
    query.add_block = [&](const BlockRows& rows, client::QueryBuilder& builder) {
      client::ContainsBlock block = builder.contains();
      apply_to_block(options.query, block);
      block.frame(rows.frame).columns(layout.columns).points(rows.offsets);
      apply_filter_columns(options.query, rows, 1, block);
    };
    return run_bulk_query(query, options.query, options.bulk, context);
  }
  RETURN_IF_ERROR(check(options.bulk));
  if (options.at.empty()) return usage_error("give --at, or rows with --from-csv or --from-ndjson");
  const FramedPositions at = framed(options.at);
  layout.frame = at.frame;
  client::QueryBuilder builder;
  client::ContainsBlock block = builder.contains();
  apply_to_block(options.query, block);
  block.frame(at.frame).columns(layout.columns).points(at.offsets);
  return ask_and_report(options.query, builder, layout, "found", context);
}

RowLayout layout_of_cell(const PointOptions& options) {
  return {.query = "cell",
          .columns = columns_behind({v1::COLUMN_T, v1::COLUMN_ID}, options.query,
                                    {v1::COLUMN_TRIANGLE, v1::COLUMN_NORMAL, v1::COLUMN_POINT})};
}

absl::Status query_cell(const PointOptions& options, Context& context) {
  RowLayout layout = layout_of_cell(options);
  if (options.bulk.given()) {
    RETURN_IF_ERROR(check_input(options));
    BulkQuery query = {.schema = {at_field()}, .layout = layout, .rows_name = "planes", .add_block = {}};
    query.schema.push_back(column_or_option({.name = "max_distance", .kind = FieldKind::kDistance, .required = true},
                                            options.max_distances, "--max-distance"));
    add_filter_fields(options.query, query.schema);
    query.add_block = [&](const BlockRows& rows, client::QueryBuilder& builder) {
      client::CellBlock block = builder.cells();
      apply_to_block(options.query, block);
      block.frame(rows.frame).columns(layout.columns).max_planes(options.max_planes);
      block.points(rows.offsets, float_column(rows.batch.columns[1], rows.rows, {0}, floats_of(options.max_distances)));
      apply_filter_columns(options.query, rows, 2, block);
    };
    return run_bulk_query(query, options.query, options.bulk, context);
  }
  RETURN_IF_ERROR(check(options.bulk));
  if (options.at.empty() || options.max_distances.empty())
    return usage_error("give --at and --max-distance, or rows with --from-csv or --from-ndjson");
  const FramedPositions at = framed(options.at);
  layout.frame = at.frame;
  client::QueryBuilder builder;
  client::CellBlock block = builder.cells();
  apply_to_block(options.query, block);
  block.frame(at.frame).columns(layout.columns).max_planes(options.max_planes);
  block.points(at.offsets, floats_of(options.max_distances));
  return ask_and_report(options.query, builder, layout, "planes", context);
}

}  // namespace

void add_query_frustum(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<FrustumOptions>();
  CLI::App& command = *parent.add_subcommand("frustum", "Ask what is in view, or in a convex region");
  command.footer(R"(Examples:
  locus query frustum arena --plane 1,0,0,5 --plane -1,0,0,5 --plane 0,1,0,5 --plane 0,-1,0,5
  locus query frustum arena --view 1,0,0,0,0,1,0,0,0,0,-1,-1,0,0,-0.1,0 --source dynamic

A point p is inside of a plane nx,ny,nz,d if n.p + d is 0 or more; a region has 4 to 32 planes. A view is a
column-major matrix from positions to clip coordinates. Rows: view.0,view.1, ... view.9,view.a, ... view.f
[,mask,ignore_group], or {"view": [16 numbers]}.)");
  add_repeatable(command, "--plane", options->planes, "NX,NY,NZ,D", "A plane of the region; repeat for each");
  command.add_option("--view", options->matrix, "A view-projection matrix: 16 numbers, column by column")
      ->type_name("NUMBERS")
      ->delimiter(',')
      ->expected(16);
  const NamedValues<v1::ClipDepth> depths = {{"zero", v1::CLIP_DEPTH_ZERO_TO_ONE},
                                             {"minus-one", v1::CLIP_DEPTH_MINUS_ONE_TO_ONE}};
  command.add_option("--clip-depth", options->clip_depth, "Where the depth of --view begins: zero, minus-one [zero]")
      ->type_name("DEPTH")
      ->transform(choices(depths));
  add_detail_option(command, options->detail);
  add_after_id_option(command, options->query);
  add_bulk_query_options(command, options->bulk);
  add_query_options(command, options->query);
  run_or_check_when_chosen(command, options, context, query_frustum);
}

void add_query_contains(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<PointOptions>();
  CLI::App& command = *parent.add_subcommand("contains", "Ask what objects and closed meshes points are in");
  command.footer(R"(Examples:
  locus query contains arena --at 0,0,0
  locus query contains zones --at 10,2,3 --source static --columns tag,group
  locus -o csv query contains zones --from-csv players.csv > zones.csv

A mesh without open edges (see `locus mesh show`) is closed and contains what it winds around. Rows:
at.x,at.y,at.z[,mask,ignore_group] or {"at": [0,0,0]}.)");
  add_repeatable(command, "--at", options->at, "X,Y,Z", "A point; repeat for more");
  add_after_id_option(command, options->query);
  add_bulk_query_options(command, options->bulk);
  add_query_options(command, options->query);
  run_or_check_when_chosen(command, options, context, query_contains);
}

void add_query_cell(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<PointOptions>();
  CLI::App& command = *parent.add_subcommand("cell", "Ask for the convex free space around points");
  command.footer(R"(Examples:
  locus query cell arena --at 0,1,0 --max-distance 20
  locus -o json query cell arena --at 0,1,0 --max-distance 20 --max-planes 8 --source static

The first row of a cell has no id, and as t the radius that bounds the space. Each further row is a plane: its distance,
the object or triangle behind it, its normal away from the point, and where it touches. Rows:
at.x,at.y,at.z,max_distance[,mask,ignore_group] or {"at": [0,1,0], "max_distance": 20}.)");
  add_repeatable(command, "--at", options->at, "X,Y,Z", "A point; repeat for more");
  add_repeatable(command, "--max-distance", options->max_distances, "D",
                 "Radius within which to look, one for each or one for all");
  command.add_option("--max-planes", options->max_planes, "Maximum number of planes, up to 64 [32]")
      ->type_name("PLANES");
  add_bulk_query_options(command, options->bulk);
  add_query_options(command, options->query);
  run_or_check_when_chosen(command, options, context, query_cell);
}

}  // namespace locus::cli
