// `locus bench`: measures how many queries and moves a server answers, and how fast.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "client/cli/choices.h"
#include "client/cli/commands.h"
#include "client/cli/extras/bench/bench_load.h"
#include "client/cli/failure.h"
#include "client/cli/progress.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr double kSpacing = 10;  // mean distance of the objects of a scene that bench makes
constexpr uint64_t kInsertBatch = 65536;

const NamedValues<BenchKind>& kind_names() {
  static const auto& names = *new NamedValues<BenchKind>{{"rays", BenchKind::kRays},
                                                         {"balls", BenchKind::kBalls},
                                                         {"boxes", BenchKind::kBoxes},
                                                         {"nearest", BenchKind::kNearest},
                                                         {"moves", BenchKind::kMoves}};
  return names;
}

std::string name_of(BenchKind kind) {
  for (const auto& [name, value] : kind_names())
    if (value == kind) return name;
  return "";
}

struct BenchOptions {
  std::string scene;  // an existing scene, only to read; empty = a scene of its own
  uint32_t connections = 2;
  std::vector<BenchKind> kinds;
  uint32_t batch = 256;
  uint64_t movers = 10'000;
  double seconds = 5;
  uint64_t seed = 1;
};

// Returns the kinds to measure, in a fixed order, each once. Without --kinds all, but no moves in a scene of the user.
std::vector<BenchKind> kinds_of(const BenchOptions& options) {
  std::vector<BenchKind> kinds;
  for (const auto& [name, kind] : kind_names()) {
    const bool named = std::find(options.kinds.begin(), options.kinds.end(), kind) != options.kinds.end();
    const bool by_default = options.kinds.empty() && (options.scene.empty() || kind != BenchKind::kMoves);
    if (named || by_default) kinds.push_back(kind);
  }
  return kinds;
}

absl::Status check(const BenchOptions& options) {
  const auto moves = std::find(options.kinds.begin(), options.kinds.end(), BenchKind::kMoves);
  if (!options.scene.empty() && moves != options.kinds.end())
    return usage_error("--scene is only read: leave moves out of --kinds");
  if (options.scene.empty() && options.movers < options.connections)
    return usage_error("give at least as many --movers as --connections: each connection moves its own");
  return absl::OkStatus();
}

Json rounded(double number) { return Json::parse(absl::StrFormat("%.3f", number)); }

// Scene that is deleted at the end.
class OwnScene {
 public:
  explicit OwnScene(const client::Client& client)
      : client_(client), name_(absl::StrCat("bench-", absl::Hex(absl::ToUnixNanos(absl::Now())))) {}
  ~OwnScene() {
    if (made_) remove().IgnoreError();  // the command reports the error that ended it
  }
  OwnScene(const OwnScene&) = delete;
  OwnScene& operator=(const OwnScene&) = delete;

  // Makes the scene and inserts the objects.
  absl::Status make(const BenchLoad& load, ProgressWriter& progress) {
    v1::CreateSceneRequest request;
    request.set_name(name_);
    RETURN_IF_ERROR(client_.create_scene(request).status());
    made_ = true;
    progress.begin({.action = "inserting", .subject = name_, .unit = "objects", .total = load.objects});
    DemoRandom random(load.seed);
    for (uint64_t first = 1; first <= load.objects; first += kInsertBatch) {
      const uint64_t count = std::min(kInsertBatch, load.objects + 1 - first);
      ASSIGN_OR_RETURN(const v1::UpdateAck ack, client_.apply(name_, bench_inserts(load, first, count, random)));
      RETURN_IF_ERROR(refused_items(ack));
      progress.update(first + count - 1);
    }
    return absl::OkStatus();
  }
  absl::Status remove() {
    made_ = false;
    v1::DeleteSceneRequest request;
    request.set_name(name_);
    return client_.delete_scene(request);
  }
  const std::string& name() const { return name_; }

 private:
  const client::Client& client_;
  const std::string name_;
  bool made_ = false;
};

// Sets the bounds of the queries: those of the scene --scene, or a cube that gives each object its place.
absl::Status set_bounds(const BenchOptions& options, const client::Client& client, BenchLoad& load) {
  if (options.scene.empty()) {
    const double half = kSpacing * std::cbrt(static_cast<double>(options.movers)) / 2;
    load.bounds = {{-half, -half, -half}, {half, half, half}};
    return absl::OkStatus();
  }
  ASSIGN_OR_RETURN(const v1::Scene scene, client.get_scene(options.scene));
  if (!scene.has_min() || !scene.has_max())
    return absl::FailedPreconditionError(absl::StrCat("scene ", options.scene, " is empty, there is nothing to query"));
  load.bounds = {{scene.min().x(), scene.min().y(), scene.min().z()},
                 {scene.max().x(), scene.max().y(), scene.max().z()}};
  return absl::OkStatus();
}

absl::Status measure(const BenchOptions& options, const std::vector<std::unique_ptr<client::Client>>& connections,
                     BenchLoad load, ProgressWriter& progress, Report& report) {
  for (const BenchKind kind : kinds_of(options)) {
    load.kind = kind;
    progress.begin(
        {.action = "measuring", .subject = name_of(kind), .unit = kind == BenchKind::kMoves ? "moves" : "queries"});
    const absl::Time start = absl::Now();
    ASSIGN_OR_RETURN(const BenchFigures figures, run_bench(connections, load, [&](uint64_t items) {
                       progress.update_share(items, absl::ToDoubleSeconds(absl::Now() - start) / load.seconds);
                     }));
    report.rows.push_back({{"kind", name_of(kind)},
                           {"items", figures.items},
                           {"batches", figures.batches},
                           {"rate_per_s", static_cast<uint64_t>(figures.rate())},
                           {"p50_ms", rounded(percentile(figures.milliseconds, 0.5))},
                           {"p99_ms", rounded(percentile(figures.milliseconds, 0.99))},
                           {"p999_ms", rounded(percentile(figures.milliseconds, 0.999))},
                           {"refused", figures.refused}});
  }
  return absl::OkStatus();
}

absl::Status bench(const BenchOptions& options, Context& context) {
  RETURN_IF_ERROR(check(options));
  std::vector<std::unique_ptr<client::Client>> connections;
  for (uint32_t i = 0; i < options.connections; ++i) {
    ASSIGN_OR_RETURN(std::unique_ptr<client::Client> connection, context.open_connection());
    connections.push_back(std::move(connection));
  }
  const client::Client& first = *connections.front();
  BenchLoad load;
  load.batch = options.batch;
  load.seconds = options.seconds;
  load.seed = options.seed;
  RETURN_IF_ERROR(set_bounds(options, first, load));
  ProgressWriter progress = start_progress(context);
  OwnScene own(first);
  load.scene = options.scene;
  if (options.scene.empty()) {
    load.scene = own.name();
    load.objects = options.movers;
    RETURN_IF_ERROR(own.make(load, progress));
  }
  Report report;
  report.rows_name = "kinds";
  report.head = {{"connections", options.connections}, {"batch", options.batch}, {"seconds", options.seconds}};
  report.head[options.scene.empty() ? "objects" : "scene"] =
      options.scene.empty() ? Json(options.movers) : Json(options.scene);
  RETURN_IF_ERROR(measure(options, connections, load, progress, report));
  if (options.scene.empty()) RETURN_IF_ERROR(own.remove());
  progress.hide();
  context.write(report);
  return absl::OkStatus();
}

}  // namespace

void add_bench_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<BenchOptions>();
  CLI::App& command =
      *parent.add_subcommand("bench", "Measure how many queries and moves a server answers, and how fast");
  command.footer(
      R"(Each kind is measured alone. Each connection sends a batch as soon as its last one is answered; a latency is that of a
batch. The scene is made for this and deleted afterwards. With --scene an existing one is only queried.
Examples:
  locus bench
  locus bench --connections 8 --batch 1024 --kinds rays,nearest
  locus bench --movers 100000 --kinds moves --seconds 30
  locus bench --scene arena --batch 1
  locus -o json bench --seconds 2)");
  command.add_option("--scene", options->scene, "Query this scene, and change nothing [one of its own]")
      ->type_name("SCENE");
  command.add_option("--connections", options->connections, "Connections, each with its own thread [2]")
      ->type_name("N")
      ->check(CLI::Range(1, 1024).description(""));
  command.add_option("--kinds", options->kinds, "What to measure: rays, balls, boxes, nearest, moves [all]")
      ->type_name("KIND,...")
      ->delimiter(',')
      ->transform(choices(kind_names()));
  command.add_option("--batch", options->batch, "Queries or moves in a batch [256]")
      ->type_name("N")
      ->check(CLI::Range(1, 65536).description(""));
  command.add_option("--movers", options->movers, "Objects of the scene [10000]")
      ->type_name("N")
      ->check(CLI::Range(1, 10'000'000).description(""));
  command.add_option("--seconds", options->seconds, "How long to measure each kind [5]")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.01, 86400.0).description(""));
  command.add_option("--seed", options->seed, "Seed of all random numbers [1]")->type_name("N");
  run_when_chosen(command, options, context, bench);
}

}  // namespace locus::cli
