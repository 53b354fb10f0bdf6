#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/commands/bulk_query.h"
#include "client/cli/commands/query_command.h"
#include "client/cli/failure.h"
#include "client/lib/result_rows.h"
#include "core/base/status_macros.h"

// The commands `locus query sight`, which queries lines of sight between viewers and targets, and `locus query pairs`,
// which queries pairs of objects near each other.
namespace locus::cli {
namespace {

struct SightOptions {
  QueryOptions query;
  BulkOptions bulk;
  std::vector<Triple> viewers;
  std::vector<Triple> targets;
  std::vector<Number64> viewer_groups;
  std::vector<Number64> target_groups;
  std::vector<double> max_distances;
  uint32_t samples = 1;
  bool pairwise = false;
};

struct PairOptions {
  QueryOptions query;
  double max_distance = 0;
  uint32_t first_mask = 0;
  uint32_t second_mask = 0;
  uint32_t k = 0;
  Number64 after_other;
};

enum SightField : size_t { kEye, kTarget, kViewerGroup, kTargetGroup, kSightDistance, kSightFilter };

absl::Status query_sight_of_input(const SightOptions& options, Context& context) {
  absl::Status checked = check(options.query, options.bulk);
  if (checked.ok() && (!options.viewers.empty() || !options.targets.empty() || options.samples != 1))
    checked = usage_error("give --viewer, --target and --samples or an input with its columns, not both");
  checked.Update(at_most_one(options.viewer_groups, "--viewer-group"));
  checked.Update(at_most_one(options.target_groups, "--target-group"));
  checked.Update(at_most_one(options.max_distances, "--max-distance"));
  RETURN_IF_ERROR(checked);
  BulkQuery query = {.schema = {}, .layout = {.query = "sight"}, .rows_name = "sight", .add_block = {}};
  query.answer = BulkAnswer::kSeen;
  query.schema = {
      {.name = "viewer", .kind = FieldKind::kCoordinate, .parts = "xyz", .required = true},
      {.name = "target", .kind = FieldKind::kCoordinate, .parts = "xyz", .required = true},
      column_or_option({.name = "viewer_group", .kind = FieldKind::kId}, options.viewer_groups, "--viewer-group"),
      column_or_option({.name = "target_group", .kind = FieldKind::kId}, options.target_groups, "--target-group"),
      column_or_option({.name = "max_distance", .kind = FieldKind::kDistance}, options.max_distances,
                       "--max-distance")};
  add_filter_fields(options.query, query.schema);
  query.add_block = [&](const BlockRows& rows, client::QueryBuilder& builder) {
    const std::vector<RowColumn>& columns = rows.batch.columns;
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    client::SightBlock block = builder.sight();
    apply_to_block(options.query, block);
    block.frame(rows.frame).pairwise().viewers(rows.offsets);
    block.targets(offsets_of(columns[kTarget], rows.rows, rows.frame));
    block.viewer_groups(id_column(columns[kViewerGroup], rows.rows, 0, values_of(options.viewer_groups)));
    block.target_groups(id_column(columns[kTargetGroup], rows.rows, 0, values_of(options.target_groups)));
    block.max_distances(
        float_column(columns[kSightDistance], rows.rows, {kInfinity}, floats_of(options.max_distances)));
    apply_filter_columns(options.query, rows, kSightFilter, block);
  };
  return run_bulk_query(query, options.query, options.bulk, context);
}

absl::Status query_sight(const SightOptions& options, Context& context) {
  if (options.bulk.given()) return query_sight_of_input(options, context);
  RETURN_IF_ERROR(check(options.bulk));
  if (options.viewers.empty() || options.targets.empty())
    return usage_error("give --viewer and --target, or rows with --from-csv or --from-ndjson");
  if (options.samples == 0 || options.targets.size() % options.samples != 0)
    return usage_error("give --samples points with --target for each target");
  const FramedPaths at = framed(options.viewers, options.targets);
  client::QueryBuilder builder;
  client::SightBlock block = builder.sight();
  apply_to_block(options.query, block);
  block.frame(at.frame).viewers(at.starts).targets(at.ends, options.samples);
  block.viewer_groups(values_of(options.viewer_groups)).target_groups(values_of(options.target_groups));
  block.max_distances(floats_of(options.max_distances));
  if (options.pairwise) block.pairwise();
  ASSIGN_OR_RETURN(const v1::QueryResult result, ask_block(options.query, builder, context));
  const size_t viewers = options.viewers.size();
  const size_t targets = options.pairwise ? 1 : options.targets.size() / options.samples;
  ASSIGN_OR_RETURN(const client::SightMatrix matrix, client::SightMatrix::of(result.blocks(0), viewers, targets));
  Report report;
  report.head = result_head(result);
  report.rows_name = "sight";
  report.keys = {"viewer", "target", "seen"};
  const bool with_time = rows_have_time(options.query.past, context.format());
  if (with_time) report.keys.emplace_back("as_of");
  const Json times = with_time ? resolved_json(result.blocks(0)) : Json::array();
  for (size_t viewer = 0; viewer < viewers; ++viewer) {
    for (size_t target = 0; target < targets; ++target) {
      Json& row = report.rows.emplace_back(Json{
          {"viewer", viewer}, {"target", options.pairwise ? viewer : target}, {"seen", matrix.seen(viewer, target)}});
      if (with_time) row["as_of"] = viewer < times.size() ? times[viewer] : Json();
    }
  }
  context.write(report);
  return absl::OkStatus();
}

absl::Status query_pairs(const PairOptions& options, Context& context) {
  const RowLayout layout = {.columns = columns_behind({v1::COLUMN_ID, v1::COLUMN_OTHER, v1::COLUMN_T}, options.query)};
  client::QueryBuilder builder;
  client::PairBlock block = builder.pairs();
  apply_to_block(options.query, block);
  block.columns(layout.columns);
  block.max_distance(static_cast<float>(options.max_distance)).layers(options.first_mask, options.second_mask);
  block.k(options.k).after_pair(options.query.after_id.value, options.after_other.value);
  return ask_and_report(options.query, builder, layout, "pairs", context);
}

}  // namespace

void add_query_sight(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<SightOptions>();
  CLI::App& command = *parent.add_subcommand("sight", "Ask which targets viewers see");
  command.footer(R"(Examples:
  locus query sight arena --viewer 0,1.7,0 --target 20,1.5,3
  locus query sight arena --viewer 0,1.7,0 --viewer-group 4 --target 20,1.5,3 --target-group 9 --max-distance 100
  locus query sight arena --viewer 0,1.7,0 --target 20,0.3,3 --target 20,1,3 --target 20,1.7,3 --samples 3
  locus -o csv query sight arena --from-csv pairs.csv > seen.csv

The answer has the number of seen points for each viewer and target. A viewer's and a target's own group do not block.
Rows: viewer.x,viewer.y,viewer.z,target.x,target.y,target.z[,viewer_group,target_group,max_distance,mask,ignore_group]
or {"viewer": [0,1.7,0], "target": [20,1.5,3]}: whether this viewer sees this target.)");
  add_repeatable(command, "--viewer", options->viewers, "X,Y,Z", "An eye; repeat for more viewers");
  add_repeatable(command, "--target", options->targets, "X,Y,Z", "A point of a target; repeat for more");
  command.add_option("--samples", options->samples, "Points of each target, up to 255 [1]")->type_name("POINTS");
  add_repeatable(command, "--viewer-group", options->viewer_groups, "GROUP",
                 "Group of a viewer; one for each, or one for all");
  add_repeatable(command, "--target-group", options->target_groups, "GROUP",
                 "Group of a target; one for each, or one for all");
  add_repeatable(command, "--max-distance", options->max_distances, "D",
                 "How far a viewer sees; one for each, or one for all [inf]");
  command.add_flag("--pairwise", options->pairwise, "Ask only whether viewer i sees target i");
  add_bulk_query_options(command, options->bulk);
  add_query_options(command, options->query);
  run_or_check_when_chosen(command, options, context, query_sight);
}

void add_query_pairs(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<PairOptions>();
  CLI::App& command = *parent.add_subcommand("pairs", "Ask which objects are near each other");
  command.footer(R"(Examples:
  locus query pairs arena --max-distance 2
  locus query pairs arena --max-distance 10 --k 1 --first-mask 1 --second-mask 4
  locus query pairs arena --max-distance 2 --max-results 100 --after-id 17 --after-other 23

Each pair has one row, with the lower id first; with --k, each object has a row for each of the nearest others.)");
  command.add_option("--max-distance", options->max_distance, "Maximum distance between the solids [0: they touch]")
      ->type_name("D");
  command.add_option("--first-mask", options->first_mask, "Layers of the first object [all]")->type_name("BITS");
  command.add_option("--second-mask", options->second_mask, "Layers of the second object [all]")->type_name("BITS");
  command.add_option("--k", options->k, "The nearest of each object instead of all pairs")->type_name("K");
  command
      .add_option("--after-id", options->query.after_id, "Continue behind the pair of this object and --after-other")
      ->type_name("ID");
  command.add_option("--after-other", options->after_other, "Second object of the last pair")->type_name("ID");
  add_query_options(command, options->query);
  run_or_check_when_chosen(command, options, context, query_pairs);
}

}  // namespace locus::cli
