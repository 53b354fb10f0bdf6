#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/arguments.h"
#include "client/cli/choices.h"
#include "client/cli/commands.h"
#include "client/cli/query_command.h"
#include "client/lib/result_rows.h"

namespace locus::cli {
namespace {

struct RayOptions {
  QueryOptions query;
  std::vector<Triple> from;
  std::vector<Triple> directions;
  std::vector<double> t_max;
  v1::RayMode mode = v1::RAY_MODE_FIRST;
  v1::Cull cull = v1::CULL_UNSPECIFIED;
  v1::Inside inside = v1::INSIDE_UNSPECIFIED;
};

absl::Status report_any(const RayOptions& options, client::QueryBuilder& builder, Context& context) {
  const absl::StatusOr<v1::QueryResult> result = ask_block(options.query, builder, context);
  if (!result.ok()) return result.status();
  const absl::StatusOr<client::AnyHits> hits = client::AnyHits::of(result->blocks(0));
  if (!hits.ok()) return hits.status();
  Report report;
  report.head = result_head(*result);
  report.rows_name = "rays";
  report.keys = {"ray", "hit"};
  for (size_t ray = 0; ray < hits->size(); ++ray) report.rows.push_back({{"ray", ray}, {"hit", hits->hit(ray)}});
  context.write(report);
  return absl::OkStatus();
}

absl::Status query_ray(const RayOptions& options, Context& context) {
  const FramedPositions from = framed(options.from);
  client::QueryBuilder builder;
  client::RayBlock block = builder.rays();
  block.frame(from.frame).mode(options.mode).cull(options.cull).inside(options.inside);
  block.rays(from.offsets, floats_of(options.directions)).t_max(floats_of(options.t_max));
  apply_to_block(options.query, block);
  if (options.mode == v1::RAY_MODE_ANY) return report_any(options, builder, context);
  // Whatever is to be shown, t and id tell a hit from a miss.
  RowLayout layout = {.query = "ray", .columns = {v1::COLUMN_T, v1::COLUMN_ID}, .frame = from.frame};
  layout.dense = options.mode == v1::RAY_MODE_FIRST;
  std::vector<v1::Column> more = options.query.columns;
  if (more.empty()) more = {v1::COLUMN_TRIANGLE, v1::COLUMN_POINT, v1::COLUMN_NORMAL};
  layout.columns.insert(layout.columns.end(), more.begin(), more.end());
  block.columns(layout.columns);
  return ask_and_report(options.query, builder, layout, "hits", context);
}

void add_ray_options(CLI::App& command, RayOptions& options) {
  add_repeatable(command, "--from", options.from, "X,Y,Z", "Where it starts; repeat --from and --dir for more rays")
      ->required();
  add_repeatable(command, "--dir", options.directions, "X,Y,Z",
                 "Where it goes, any length but zero; t counts in this length; one for each or one for all")
      ->required();
  add_repeatable(command, "--max-t", options.t_max, "T", "How far, in lengths of --dir [inf]");
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
  locus query ray arena --from 0,1,0 --dir 0,0,-1 --max-t 100 --mode all --source static
  locus query ray arena --from 0,1,0 --from 5,1,0 --dir 0,-1,0 --mode any
  locus query ray arena --from 0,1,0 --dir 1,0,0 --mask 6 --ignore-group 3 --cull back --inside skip
  locus -o json query ray arena --from 0,1,0 --dir 1,0,0 --columns uv,group,tag)");
  add_ray_options(command, *options);
  add_query_options(command, options->query);
  run_when_chosen(command, options, context, query_ray);
}

}  // namespace locus::cli
