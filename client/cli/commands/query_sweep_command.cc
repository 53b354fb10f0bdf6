#include <memory>
#include <string>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/choices.h"
#include "client/cli/commands.h"
#include "client/cli/commands/bulk_query.h"
#include "client/cli/commands/query_command.h"
#include "client/cli/failure.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct SweepOptions {
  QueryOptions query;
  BulkOptions bulk;
  std::vector<Triple> from;
  std::vector<Triple> to;
  std::vector<double> radii;
  std::vector<Triple> half_axes;
  std::vector<Triple> half_extents;
  std::vector<Quaternion> rotations;
  v1::RayMode mode = v1::RAY_MODE_FIRST;
  v1::AtStart at_start = v1::AT_START_UNSPECIFIED;
};

RowLayout layout_of(const SweepOptions& options) {
  RowLayout layout = {.query = "sweep"};
  layout.dense = options.mode == v1::RAY_MODE_FIRST;
  layout.columns = columns_behind({v1::COLUMN_T, v1::COLUMN_ID}, options.query,
                                  {v1::COLUMN_TRIANGLE, v1::COLUMN_POINT, v1::COLUMN_NORMAL});
  return layout;
}

// Sets the settings and columns of a sweep block, except its paths and radii.
void apply_to_sweeps(const SweepOptions& options, const RowLayout& layout, const client::Double3& frame,
                     client::SweepBlock& block) {
  apply_to_block(options.query, block);
  block.frame(frame).mode(options.mode).at_start(options.at_start);
  if (options.mode != v1::RAY_MODE_ANY) block.columns(layout.columns);
  block.half_axes(floats_of(options.half_axes)).half_extents(floats_of(options.half_extents));
  block.rotations(floats_of(options.rotations));
}

enum SweepField : size_t { kSweepFrom, kSweepWay, kSweepRadius, kSweepFilter };

absl::Status query_sweeps_of_input(const SweepOptions& options, Context& context) {
  absl::Status checked = check(options.query, options.bulk);
  if (checked.ok() && (!options.from.empty() || !options.to.empty()))
    checked = usage_error("give --from and --to or an input with its columns, not both");
  checked.Update(at_most_one(options.radii, "--radius"));
  checked.Update(at_most_one(options.half_axes, "--half-axis"));
  checked.Update(at_most_one(options.half_extents, "--half"));
  checked.Update(at_most_one(options.rotations, "--rotation"));
  RETURN_IF_ERROR(checked);
  BulkQuery query = {.schema = {}, .layout = layout_of(options), .rows_name = "hits", .add_block = {}};
  if (options.mode == v1::RAY_MODE_ANY) {
    query.answer = BulkAnswer::kHits;
    query.rows_name = "sweeps";
  }
  const bool boxes = !options.half_extents.empty();
  query.schema = {{.name = "from", .kind = FieldKind::kCoordinate, .parts = "xyz", .required = true},
                  {.name = "way", .parts = "xyz", .required = true},
                  column_or_option({.name = "radius", .required = !boxes}, options.radii, "--radius")};
  add_filter_fields(options.query, query.schema);
  query.add_block = [&](const BlockRows& rows, client::QueryBuilder& builder) {
    const std::vector<RowColumn>& columns = rows.batch.columns;
    client::SweepBlock block = builder.sweeps();
    apply_to_sweeps(options, query.layout, rows.frame, block);
    std::vector<float> ends = float_column(columns[kSweepWay], rows.rows, {0, 0, 0}, {});
    for (size_t i = 0; i < ends.size(); ++i) ends[i] += rows.offsets[i];
    block.sweeps(rows.offsets, ends);
    if (!boxes) block.radii(float_column(columns[kSweepRadius], rows.rows, {0}, floats_of(options.radii)));
    apply_filter_columns(options.query, rows, kSweepFilter, block);
  };
  return run_bulk_query(query, options.query, options.bulk, context);
}

absl::Status query_sweep(const SweepOptions& options, Context& context) {
  if (options.bulk.given()) return query_sweeps_of_input(options, context);
  RETURN_IF_ERROR(check(options.bulk));
  if (options.from.empty() || options.to.empty() || (options.radii.empty() && options.half_extents.empty()))
    return usage_error("give --from, --to and --radius or --half, or rows with --from-csv or --from-ndjson");
  const FramedPaths at = framed(options.from, options.to);
  RowLayout layout = layout_of(options);
  layout.frame = at.frame;
  client::QueryBuilder builder;
  client::SweepBlock block = builder.sweeps();
  apply_to_sweeps(options, layout, at.frame, block);
  block.sweeps(at.starts, at.ends);
  block.radii(floats_of(options.radii));
  if (options.mode == v1::RAY_MODE_ANY) return ask_and_report_any(options.query, builder, "sweep", context);
  return ask_and_report(options.query, builder, layout, "hits", context);
}

}  // namespace

void add_query_sweep(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<SweepOptions>();
  CLI::App& command = *parent.add_subcommand("sweep", "Ask what moving balls, capsules and boxes hit");
  command.footer(R"(Examples:
  locus query sweep arena --from 0,1,0 --to 9,1,0 --radius 0.4
  locus query sweep arena --from 0,1,0 --to 0,1,3 --radius 0.4 --half-axis 0,0.6,0 --at-start approach
  locus query sweep arena --from 0,5,0 --to 0,0,0 --half 1,1,2 --mode all

t goes from 0 at --from to 1 at --to. Rows: from.x,from.y,from.z,way.x,way.y,way.z,radius[,mask,ignore_group] or
{"from": [0,1,0], "way": [9,0,0], "radius": 0.4}, where way leads from the start to the end; an option given once
stands for a column. All rows are answered at one revision; see --follow.)");
  add_repeatable(command, "--from", options->from, "X,Y,Z", "Where its centre starts; repeat for more sweeps");
  add_repeatable(command, "--to", options->to, "X,Y,Z", "Where its centre ends, one for each or one for all");
  add_repeatable(command, "--radius", options->radii, "R", "Radius of balls and capsules, one for each or one for all");
  add_repeatable(command, "--half-axis", options->half_axes, "X,Y,Z",
                 "Capsules: from the centre to one end of the inner segment, one for each or one for all");
  add_repeatable(command, "--half", options->half_extents, "X,Y,Z",
                 "Boxes: half the size along their own axes, one for each or one for all");
  add_repeatable(command, "--rotation", options->rotations, "X,Y,Z,W", "Boxes: unit quaternion [0,0,0,1]");
  const NamedValues<v1::RayMode> modes = {
      {"first", v1::RAY_MODE_FIRST}, {"any", v1::RAY_MODE_ANY}, {"all", v1::RAY_MODE_ALL}};
  command.add_option("--mode", options->mode, "Which hits: first, any (yes or no), all [first]")
      ->type_name("MODE")
      ->transform(choices(modes));
  const NamedValues<v1::AtStart> rules = {
      {"hit", v1::AT_START_HIT}, {"approach", v1::AT_START_APPROACH}, {"pass", v1::AT_START_PASS}};
  command
      .add_option("--at-start", options->at_start,
                  "What it touches at the start: hit, approach (only what it moves against), pass [hit]")
      ->type_name("RULE")
      ->transform(choices(rules));
  add_bulk_query_options(command, options->bulk);
  add_query_options(command, options->query);
  run_or_check_when_chosen(command, options, context, query_sweep);
}

}  // namespace locus::cli
