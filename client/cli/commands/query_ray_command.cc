#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
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

struct RayOptions {
  QueryOptions query;
  BulkOptions bulk;
  std::vector<Triple> from;
  std::vector<Triple> directions;
  std::vector<double> t_max;
  std::optional<Quaternion> rotation;
  v1::RayMode mode = v1::RAY_MODE_FIRST;
  v1::Cull cull = v1::CULL_UNSPECIFIED;
  v1::Inside inside = v1::INSIDE_UNSPECIFIED;
};

// Returns the layout of the report's rows: t and id always, since they distinguish a hit from a miss, then the
// requested columns.
RowLayout layout_of(const RayOptions& options) {
  RowLayout layout = {.query = "ray"};
  layout.dense = options.mode == v1::RAY_MODE_FIRST;
  layout.columns = columns_behind({v1::COLUMN_T, v1::COLUMN_ID}, options.query,
                                  {v1::COLUMN_TRIANGLE, v1::COLUMN_POINT, v1::COLUMN_NORMAL});
  return layout;
}

void apply_to_rays(const RayOptions& options, const RowLayout& layout, const client::Double3& frame,
                   client::RayBlock& block) {
  block.frame(frame).mode(options.mode).cull(options.cull).inside(options.inside);
  apply_to_block(options.query, block);
  if (const auto& q = options.rotation) block.rotation({q->x, q->y, q->z, q->w});
  if (options.mode != v1::RAY_MODE_ANY) block.columns(layout.columns);
}

enum RayField : size_t { kRayFrom, kRayDir, kRayMaxT, kRayFilter };

absl::Status query_rays_of_input(const RayOptions& options, Context& context) {
  absl::Status checked = check(options.query, options.bulk);
  if (checked.ok() && !options.from.empty())
    checked = usage_error("give --from or an input with its columns, not both");
  checked.Update(at_most_one(options.directions, "--dir"));
  checked.Update(at_most_one(options.t_max, "--t-max"));
  RETURN_IF_ERROR(checked);
  BulkQuery query = {.schema = {}, .layout = layout_of(options), .rows_name = "hits", .add_block = {}};
  if (options.mode == v1::RAY_MODE_ANY) {
    query.answer = BulkAnswer::kHits;
    query.rows_name = "rays";
  }
  query.schema = {{.name = "from", .kind = FieldKind::kCoordinate, .parts = "xyz", .required = true},
                  column_or_option({.name = "dir", .parts = "xyz", .required = true}, options.directions, "--dir"),
                  column_or_option({.name = "t_max", .kind = FieldKind::kDistance, .parts = {}, .aliases = {"max_t"}},
                                   options.t_max, "--t-max")};
  add_filter_fields(options.query, query.schema);
  query.add_block = [&](const BlockRows& rows, client::QueryBuilder& builder) {
    const std::vector<RowColumn>& columns = rows.batch.columns;
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    client::RayBlock block = builder.rays();
    apply_to_rays(options, query.layout, rows.frame, block);
    block.rays(rows.offsets, float_column(columns[kRayDir], rows.rows, {0, 0, 0}, floats_of(options.directions)));
    block.t_max(float_column(columns[kRayMaxT], rows.rows, {kInfinity}, floats_of(options.t_max)));
    apply_filter_columns(options.query, rows, kRayFilter, block);
  };
  return run_bulk_query(query, options.query, options.bulk, context);
}

absl::Status query_ray(const RayOptions& options, Context& context) {
  if (options.bulk.given()) return query_rays_of_input(options, context);
  RETURN_IF_ERROR(check(options.bulk));
  if (options.from.empty() || options.directions.empty()) {
    return usage_error("give --from and --dir, or rows with --from-csv or --from-ndjson");
  }
  const FramedPositions from = framed(options.from);
  RowLayout layout = layout_of(options);
  layout.frame = from.frame;
  client::QueryBuilder builder;
  client::RayBlock block = builder.rays();
  apply_to_rays(options, layout, from.frame, block);
  block.rays(from.offsets, floats_of(options.directions)).t_max(floats_of(options.t_max));
  if (options.mode == v1::RAY_MODE_ANY) return ask_and_report_any(options.query, builder, "ray", context);
  return ask_and_report(options.query, builder, layout, "hits", context);
}

void add_query_ray_options(CLI::App& command, RayOptions& options) {
  add_repeatable(command, "--from", options.from, "X,Y,Z",
                 "Where it starts; one for each or one for all; repeat --from and --dir for more rays");
  add_repeatable(command, "--dir", options.directions, "X,Y,Z",
                 "Where it goes, any length but zero; t counts in this length; one for each or one for all");
  command.add_option("--rotation", options.rotation, "Unit quaternion that rotates every --dir [0,0,0,1]")
      ->type_name("X,Y,Z,W")
      ->check(four_numbers());
  CLI::Option* const t_max =
      add_repeatable(command, "--t-max", options.t_max, "T", "How far, in lengths of --dir [inf]");
  add_repeatable(command, "--max-t", options.t_max, "T", "Former name of --t-max")->group("")->excludes(t_max);
  const NamedValues<v1::RayMode> modes = {
      {"first", v1::RAY_MODE_FIRST}, {"any", v1::RAY_MODE_ANY}, {"all", v1::RAY_MODE_ALL}};
  command.add_option("--mode", options.mode, "Which hits: first, any (yes or no), all [first]")
      ->type_name("MODE")
      ->transform(choices(modes));
  const NamedValues<v1::Cull> culls = {{"none", v1::CULL_NONE}, {"back", v1::CULL_BACK}, {"front", v1::CULL_FRONT}};
  command.add_option("--cull", options.cull, "Side of triangles to pass: none, back, front [none]")
      ->type_name("SIDE")
      ->transform(choices(culls));
  const NamedValues<v1::Inside> insides = {
      {"solid", v1::INSIDE_SOLID}, {"hollow", v1::INSIDE_HOLLOW}, {"skip", v1::INSIDE_SKIP}};
  command
      .add_option("--inside", options.inside,
                  "An object it starts in: solid (hit at 0), hollow (where it leaves), skip [solid]")
      ->type_name("RULE")
      ->transform(choices(insides));
}

}  // namespace

void add_query_ray(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<RayOptions>();
  CLI::App& command = *parent.add_subcommand("ray", "Ask what rays hit");
  command.footer(R"(Examples:
  locus query ray arena --from 0,1,0 --dir 0,0,-1
  locus query ray arena --from 0,1,0 --dir 0,0,-1 --t-max 100 --mode all --source static
  locus query ray arena --from 0,1,0 --from 5,1,0 --dir 0,-1,0 --mode any
  locus query ray arena --from 0,1,0 --dir 1,0,0 --dir 1,0,0.1 --rotation 0,0.3826834,0,0.9238795
  locus query ray arena --from 0,1,0 --dir 1,0,0 --mask 6 --ignore-group 3 --cull back --inside skip
  locus -o json query ray arena --from 0,1,0 --dir 1,0,0 --columns uv,group,tag
  locus -o csv query ray arena --from-csv rays.csv > hits.csv
  generator | locus -o ndjson query ray arena --from-ndjson - --t-max 100

Rows: from.x,from.y,from.z,dir.x,dir.y,dir.z[,t_max,mask,ignore_group] or {"from": [0,1,0], "dir": [0,0,-1]};
an option given once stands for a column. Rows of every kind of query may also have self_id, only_group, tag and
tag_mask. All rows are answered at one revision; see --follow.)");
  add_query_ray_options(command, *options);
  add_bulk_query_options(command, options->bulk);
  add_query_options(command, options->query);
  run_or_check_when_chosen(command, options, context, query_ray);
}

}  // namespace locus::cli
