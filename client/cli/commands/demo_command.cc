// `locus demo`: uploads a level and moves objects in it (ten thousand by default) while clients query them. Checks
// answers to every kind of query that the clients send (kDemoKinds).
#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/commands.h"
#include "client/cli/extras/demo/demo_level.h"
#include "client/cli/extras/demo/demo_load.h"
#include "client/cli/extras/demo/edge_rays.h"
#include "client/cli/levels/generate/city.h"
#include "client/cli/levels/import/import_file.h"
#include "client/cli/progress.h"
#include "client/lib/query_builder.h"
#include "client/lib/result_rows.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr size_t kEdgeRaysABatch = 8192;

struct DemoOptions {
  std::string file;
  ImportOptions import;
  std::string scene = "demo";
  uint32_t objects = 10'000;
  double seconds = 5;
  double rate = 30;
  uint64_t checks = 1'000;
  uint64_t edge_rays = 100'000;
  uint64_t seed = 1;
  uint64_t city_triangles = 50'000;
  std::string compare;
};

// Table of the demo's results, with the total number of wrong answers in its rows.
class DemoTable {
 public:
  void add(const std::string& what, const Json& rest) {
    Json row = {{"what", what}};
    row.update(rest);
    report_.rows.push_back(std::move(row));
  }
  void add_load(const std::string& what, const LoadFigures& figures, double seconds) {
    add(what, {{"rate_per_s", static_cast<uint64_t>(static_cast<double>(figures.items) / seconds)},
               {"p50_ms", rounded(figures.percentile(0.50))},
               {"p99_ms", rounded(figures.percentile(0.99))},
               {"found", figures.found},
               {"checked", checked_},
               {"wrong", wrong_}});
    checked_ = wrong_ = 0;
  }
  void count(uint64_t checked, uint64_t wrong) {
    checked_ += checked;
    wrong_ += wrong;
    all_wrong_ += wrong;
  }
  // Adds a row for a check that measures no rate and no latency.
  void add_check(const std::string& what, uint64_t checked, uint64_t wrong) {
    all_wrong_ += wrong;
    add(what, {{"rate_per_s", nullptr},
               {"p50_ms", nullptr},
               {"p99_ms", nullptr},
               {"found", nullptr},
               {"checked", checked},
               {"wrong", wrong}});
  }
  uint64_t all_wrong() const { return all_wrong_; }
  Report& report() { return report_; }

 private:
  static Json rounded(double milliseconds) { return Json::parse(absl::StrFormat("%.2f", milliseconds)); }

  Report report_{.head = Json::object(), .rows_name = "rows", .rows = {}};
  uint64_t checked_ = 0, wrong_ = 0, all_wrong_ = 0;
};

absl::StatusOr<ImportedLevel> load_level(const DemoOptions& options) {
  if (!options.file.empty()) return import_file(options.file, options.import);
  ImportedLevel level;
  level.meshes.push_back(generate_city(options.city_triangles, options.seed));
  level.source_format = "generated city";
  return level;
}

void check_samples(const DemoOptions& options, const DemoLevel& level, const DemoWorld& world, LoadResult& load,
                   DemoTable& table) {
  DemoChecker checker(level.instances, world);
  for (const DemoKind kind : kDemoKinds) {
    LoadFigures& figures = load.queries[static_cast<size_t>(kind)];
    const uint64_t each = figures.samples.empty() ? 0 : options.checks / figures.samples.size() + 1;
    for (const Sample& sample : figures.samples) {
      const DemoChecker::Outcome outcome = checker.check(kind, sample.batch, sample.result, static_cast<int>(each));
      table.count(outcome.checked, outcome.differences);
    }
    table.add_load(name_of(kind), figures, load.seconds);
  }
}

absl::StatusOr<uint64_t> count_leaks(const client::Client& client, const std::string& scene, const EdgeRays& rays,
                                     const Transform& transform) {
  uint64_t leaks = 0;
  for (size_t begin = 0; begin < rays.size(); begin += kEdgeRaysABatch) {
    const size_t count = std::min(kEdgeRaysABatch, rays.size() - begin);
    const absl::Span<const float> origins(&rays.origins[3 * begin], 3 * count);
    const absl::Span<const float> directions(&rays.directions[3 * begin], 3 * count);
    client::QueryBuilder builder;
    builder.rays()
        .frame({transform.translation.x, transform.translation.y, transform.translation.z})
        .source(v1::SOURCE_STATIC)
        .rays(origins, directions);
    ASSIGN_OR_RETURN(const v1::QueryResult result, client.query(scene, builder.build()));
    ASSIGN_OR_RETURN(const client::RayHits hits, client::RayHits::of(result.blocks(0)));
    if (hits.size() != count) return absl::DataLossError("an answer does not have one row for each ray");
    for (size_t i = 0; i < count; ++i)
      if (!(hits.t(i) <= 1 + kEdgeAllowance)) ++leaks;
  }
  return leaks;
}

absl::Status check_leaks(const client::Client& client, const DemoOptions& options, const DemoLevel& level,
                         DemoTable& table) {
  uint64_t rays = 0, leaks = 0;
  const size_t each = options.edge_rays / level.instances.size();
  for (const CheckedInstance& instance : level.instances) {
    const EdgeRays aimed = aim_at_edges(instance.triangles, each, options.seed);
    ASSIGN_OR_RETURN(const uint64_t found, count_leaks(client, options.scene, aimed, instance.transform));
    rays += aimed.size();
    leaks += found;
  }
  table.add_check("rays at shared edges: leaks", rays, leaks);
  return absl::OkStatus();
}

// Returns a batch with one block for each of the demo's four kinds of query. The batch is large enough that the server
// splits it into chunks.
v1::QueryBatch mixed_batch(const DemoWorld& world, uint64_t seed) {
  DemoRandom random(seed);
  v1::QueryBatch mixed;
  for (const DemoKind kind : kDemoKinds) *mixed.add_blocks() = demo_batch(kind, world, random, 2048).blocks(0);
  return mixed;
}

// Builds a copy of the demo's scene at `tick` on a second server, options.compare, and sends one query batch to both
// servers. The answers of the two servers must be equal byte for byte.
absl::Status check_other(const client::Client& client, const DemoOptions& options, const ImportedLevel& level,
                         const DemoWorld& world, uint64_t tick, DemoTable& table, ProgressWriter& progress) {
  ASSIGN_OR_RETURN(const std::unique_ptr<client::Client> other, client::Client::connect(options.compare));
  RETURN_IF_ERROR(create_level(*other, options.scene, level, progress));
  for (const v1::UpdateBatch& batch : {world.inserts(), world.moves(tick)})
    RETURN_IF_ERROR(other->apply(options.scene, batch).status());
  const v1::QueryBatch batch = mixed_batch(world, options.seed + 77);
  const absl::StatusOr<v1::QueryResult> here = client.query(options.scene, batch);
  const absl::StatusOr<v1::QueryResult> there = other->query(options.scene, batch);
  RETURN_IF_ERROR(here.status());
  RETURN_IF_ERROR(there.status());
  uint64_t different = 0;
  for (int i = 0; i < here->blocks_size(); ++i)
    if (here->blocks(i).SerializeAsString() != there->blocks(i).SerializeAsString()) ++different;
  table.add_check("same batch on the other server: different blocks", static_cast<uint64_t>(here->blocks_size()),
                  different);
  return absl::OkStatus();
}

void describe(const DemoOptions& options, const ImportedLevel& level, const DemoLevel& placed, const LoadResult& load,
              DemoTable& table) {
  const std::string name = level.meshes.front().name;
  table.report().head = {{"level", options.file.empty() ? "generated city" : name},
                         {"triangles", placed.triangles},
                         {"objects", options.objects},
                         {"seconds", Json::parse(absl::StrFormat("%.1f", load.seconds))},
                         {"revisions", load.last_revision - load.first_revision + 1},
                         {"last_revision", load.last_revision},
                         {"wrong", table.all_wrong()}};
}

absl::Status demo(const DemoOptions& options, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ProgressWriter progress = start_progress(context);
  const bool generated = options.file.empty();
  progress.begin({.action = generated ? "generating" : "reading", .subject = generated ? "city" : options.file});
  ASSIGN_OR_RETURN(const ImportedLevel level, load_level(options));
  if (level.meshes.empty()) return absl::InvalidArgumentError("the level holds no mesh");
  const DemoLevel placed = place_level(level);
  RETURN_IF_ERROR(create_level(*client, options.scene, level, progress));

  const DemoWorld world(placed.bounds, options.objects, options.seed);
  RETURN_IF_ERROR(client->apply(options.scene, world.inserts()).status());
  const auto ticks = static_cast<uint64_t>(options.seconds * options.rate);
  progress.begin({.action = "moving",
                  .subject = absl::StrCat(options.objects, " objects while clients query"),
                  .unit = "ticks",
                  .total = ticks});
  const LoadOptions load_options{options.scene, ticks, options.rate, options.seed,
                                 [&](uint64_t sent) { progress.update(sent); }};
  ASSIGN_OR_RETURN(LoadResult load, run_load(*client, world, load_options));

  progress.begin({.action = "checking", .subject = "answers by brute force"});
  DemoTable table;
  table.add_load("moves", load.moves, load.seconds);
  check_samples(options, placed, world, load, table);
  RETURN_IF_ERROR(check_leaks(*client, options, placed, table));
  if (!options.compare.empty())
    RETURN_IF_ERROR(check_other(*client, options, level, world, load.last_tick, table, progress));
  describe(options, level, placed, load, table);
  progress.hide();
  context.write(table.report());
  if (table.all_wrong() == 0) return absl::OkStatus();
  return absl::InternalError(absl::StrCat(table.all_wrong(), " answers were wrong; please report this with the table"));
}

}  // namespace

void add_demo_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<DemoOptions>();
  CLI::App& command = *parent.add_subcommand(
      "demo", "Load a level, move objects through it while clients query it, and check the answers by brute force");
  command.footer(
      "Every answer kept for checking is compared bit for bit with the state of its own tick. Exits 1 on any "
      "difference.\nExamples:\n  locus demo\n  locus demo pak1-maps.pk3 --entry maps/delta.bsp --seconds 10\n"
      "  locus demo level.glb --objects 50000 --compare 127.0.0.1:7777");
  command.add_option("FILE", options->file, "Level to import [a generated city]")->check(CLI::ExistingFile);
  command.add_option("--entry", options->import.entry, "Level inside a .pk3");
  command.add_option("--scene", options->scene, "Scene to delete and create again")->capture_default_str();
  command.add_option("--objects", options->objects, "Moving objects")->check(CLI::Range(1, 1'000'000));
  command.add_option("--seconds", options->seconds, "How long to move them")->check(CLI::Range(0.1, 3600.0));
  command.add_option("--rate", options->rate, "Ticks a second")->check(CLI::Range(1.0, 1000.0));
  command.add_option("--checks", options->checks, "Answers of each kind to check")->check(CLI::Range(1, 1'000'000));
  command.add_option("--edge-rays", options->edge_rays, "Rays to aim at shared edges")
      ->check(CLI::Range(1, 10'000'000));
  command.add_option("--triangles", options->city_triangles, "Triangles of the generated city")
      ->check(CLI::Range(12, 10'000'000));
  command.add_option("--seed", options->seed, "Seed of all random numbers");
  command.add_option("--compare", options->compare, "A second server that must answer with the same bytes");
  run_when_chosen(command, options, context, demo);
}

}  // namespace locus::cli
