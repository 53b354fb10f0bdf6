#include "client/cli/commands/query_options.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/cli/choices.h"
#include "client/cli/default_scene.h"
#include "client/cli/failure.h"

namespace locus::cli {
namespace {

const NamedValues<v1::Column>& column_names() {
  static const auto& names = *new NamedValues<v1::Column>{
      {"t", v1::COLUMN_T},         {"id", v1::COLUMN_ID},         {"triangle", v1::COLUMN_TRIANGLE},
      {"uv", v1::COLUMN_UV},       {"normal", v1::COLUMN_NORMAL}, {"point", v1::COLUMN_POINT},
      {"group", v1::COLUMN_GROUP}, {"tag", v1::COLUMN_TAG},       {"layers", v1::COLUMN_LAYERS},
      {"pose", v1::COLUMN_POSE},   {"other", v1::COLUMN_OTHER},   {"shape", v1::COLUMN_SHAPE}};
  return names;
}

// Returns whether `value` is exactly representable as a float. If a coordinate is not, framed() chooses a frame other
// than the origin. Returns true for NaN and infinity too, so that they do not change the frame: the server refuses
// them, and its error names the position that contains them.
bool is_float(double value) { return !std::isfinite(value) || static_cast<double>(static_cast<float>(value)) == value; }

void add_filter_options(CLI::App& command, QueryOptions& options) {
  const NamedValues<v1::Source> sources = {
      {"both", v1::SOURCE_BOTH}, {"static", v1::SOURCE_STATIC}, {"dynamic", v1::SOURCE_DYNAMIC}};
  command.add_option("--source", options.source, "Search both, static (instances) or dynamic (objects) [both]")
      ->type_name("SOURCE")
      ->transform(choices(sources));
  const NamedValues<v1::Precision> precisions = {{"exact", v1::PRECISION_EXACT},
                                                 {"conservative", v1::PRECISION_CONSERVATIVE}};
  command.add_option("--precision", options.precision, "Geometry to test: exact, conservative (bounds) [exact]")
      ->type_name("PRECISION")
      ->transform(choices(precisions));
  add_repeatable(command, "--mask", options.masks, "BITS", "Find only what has one of these layers [all]")
      ->check(fits_32_bits());
  add_repeatable(command, "--ignore-group", options.ignore_groups, "GROUP",
                 "Ignore a group; one for each query, or one for all");
  add_repeatable(command, "--ignore-id", options.ignore_ids, "ID", "Ignore an id; at most 64");
  add_repeatable(command, "--self-id", options.self_ids, "ID", "Ignore an id; one for each query, or one for all");
  add_repeatable(command, "--only-group", options.only_groups, "GROUP",
                 "Find only members of these groups; at most 16");
  add_repeatable(command, "--tag", options.tags, "TAG", "Find only this tag; one for each query, or one for all");
  add_repeatable(command, "--tag-mask", options.tag_masks, "BITS", "Bits of the tag to compare with --tag [all]");
  add_repeatable(command, "--anchor", options.anchors, "ID",
                 "Count positions from this object, which is ignored; one for each query, or one for all");
  command.add_flag("--count-only", options.count_only, "Report only the number of rows of each query");
}

void add_view_options(CLI::App& command, QueryOptions& options) {
  command.add_option("--at-least", options.at_least, "Wait for this revision")->type_name("REVISION");
  command.add_option("--exactly", options.exactly, "Query exactly this revision")->type_name("REVISION");
  command.add_option("--epoch", options.epoch, "Epoch of the revision")->type_name("EPOCH");
  command.add_option("--max-work", options.max_work, "Budget in nodes, cells and tests [none]")->type_name("WORK");
  command.add_flag("--explain", options.explain, "Report the work done");
  command.add_flag("--by-list", options.by_list, "Test every value, without the scene's structures: same rows, slower");
}

}  // namespace

void add_query_options(CLI::App& command, QueryOptions& options) {
  add_scene_argument(command, options.scene);
  add_filter_options(command, options);
  command.add_option("--max-results", options.max_results, "Maximum number of rows for each query [1024]")
      ->type_name("ROWS");
  command
      .add_option("--columns", options.columns,
                  "What to show: t, id, triangle, uv, normal, point, group, tag, layers, pose, other")
      ->type_name("NAMES")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->transform(choices(column_names()));
  add_past_options(command, options.past);
  add_view_options(command, options);
}

void add_detail_option(CLI::App& command, v1::StaticDetail& detail) {
  const NamedValues<v1::StaticDetail> details = {{"instances", v1::STATIC_DETAIL_INSTANCES},
                                                 {"triangles", v1::STATIC_DETAIL_TRIANGLES},
                                                 {"sorted", v1::STATIC_DETAIL_TRIANGLES_SORTED}};
  command.add_option("--detail", detail, "Static rows: instances, triangles, sorted (triangles) [instances]")
      ->type_name("DETAIL")
      ->transform(choices(details));
}

void add_after_id_option(CLI::App& command, QueryOptions& options) {
  command.add_option("--after-id", options.after_id, "Return only higher ids, to continue a truncated answer")
      ->type_name("ID");
}

std::vector<v1::Column> columns_behind(std::vector<v1::Column> first, const QueryOptions& options,
                                       const std::vector<v1::Column>& otherwise) {
  const std::vector<v1::Column>& more = options.columns.empty() ? otherwise : options.columns;
  first.insert(first.end(), more.begin(), more.end());
  return first;
}

std::vector<v1::Column> overlap_columns(const QueryOptions& options, v1::StaticDetail detail) {
  std::vector<v1::Column> first = {v1::COLUMN_ID};
  if (detail == v1::STATIC_DETAIL_TRIANGLES || detail == v1::STATIC_DETAIL_TRIANGLES_SORTED)
    first.push_back(v1::COLUMN_TRIANGLE);
  return columns_behind(std::move(first), options);
}

absl::Status check(const QueryOptions& options) {
  if (options.at_least && options.exactly) return usage_error("give --at-least or --exactly, not both");
  if (options.tags.empty() && !options.tag_masks.empty()) return usage_error("--tag-mask needs --tag");
  return absl::OkStatus();
}

void see_own(const std::string& scene, const Context& context, client::QueryBuilder& builder) {
  if (const std::optional<client::Revision> own = context.own(scene)) builder.at_least(*own);
}

void apply_to_batch(const QueryOptions& options, const Context& context, client::QueryBuilder& builder) {
  if (!options.at_least && !options.exactly) see_own(options.scene, context, builder);
  if (options.at_least) builder.at_least({options.epoch.value, *options.at_least});
  if (options.exactly) builder.exactly({options.epoch.value, *options.exactly});
  builder.max_work(options.max_work);
  if (options.explain) builder.explain();
  if (options.by_list) builder.by_list();
}

FramedPositions framed(const std::vector<Triple>& positions) {
  const bool all_floats = std::all_of(positions.begin(), positions.end(), [](const Triple& position) {
    return is_float(position.x) && is_float(position.y) && is_float(position.z);
  });
  FramedPositions result;
  if (!all_floats) result.frame = {positions.front().x, positions.front().y, positions.front().z};
  for (const Triple& position : positions) {
    result.offsets.push_back(static_cast<float>(position.x - result.frame.x));
    result.offsets.push_back(static_cast<float>(position.y - result.frame.y));
    result.offsets.push_back(static_cast<float>(position.z - result.frame.z));
  }
  return result;
}

FramedPaths framed(const std::vector<Triple>& starts, const std::vector<Triple>& ends) {
  std::vector<Triple> all = starts;
  all.insert(all.end(), ends.begin(), ends.end());
  const FramedPositions at = framed(all);
  const auto middle = at.offsets.begin() + static_cast<ptrdiff_t>(3 * starts.size());
  return {at.frame, {at.offsets.begin(), middle}, {middle, at.offsets.end()}};
}

}  // namespace locus::cli
