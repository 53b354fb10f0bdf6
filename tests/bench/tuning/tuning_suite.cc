#include "tests/bench/tuning/tuning_suite.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/types/span.h"
#include "core/base/status_macros.h"
#include "nlohmann/json.hpp"
#include "tests/bench/dynamic/world.h"
#include "tests/bench/frame/bar.h"
#include "tests/bench/frame/results_hash.h"
#include "tests/bench/frame/statistics.h"
#include "tests/bench/frame/temporary_folder.h"
#include "tests/bench/serving/daemon.h"
#include "tests/bench/serving/process.h"
#include "tests/bench/serving/world_messages.h"
#include "tests/bench/tuning/around_objects.h"

namespace locus::bench::tuning {
namespace {

using nlohmann::json;
using serving::Daemon;
using serving::Process;

constexpr double kProgramSeconds = 600;
// The named size may take this part longer than the best, and the promised time may be off by it.
constexpr double kTolerance = 0.2;
constexpr size_t kTicksBefore = 3;
constexpr uint64_t kSettlingBatches = 20;  // after a change of the cell size: each refiles a few thousand objects

// A scene, its queries and the cell size that it has before it is tuned.
struct TuningCase {
  const char* name;
  std::optional<dynamic::Kind> kind;  // none: the quickstart's level with objects that moved in it
  Kinds kinds;
  double radius;
};
constexpr TuningCase kTuningCases[] = {{"uniform", dynamic::Kind::kUniform, Kinds::kAll, 10},
                                       {"hub60", dynamic::Kind::kHub60, Kinds::kAll, 10},
                                       {"mixed", dynamic::Kind::kMixed, Kinds::kAll, 10},
                                       {"balls100", dynamic::Kind::kUniform, Kinds::kBalls, 100},
                                       {"level", std::nullopt, Kinds::kAll, 10}};
// Cell sizes that a scene has before. 0 is the server's choice; the others are far from every good size. Quick runs
// only have the first.
constexpr double kPresentSizes[] = {0, 0.5, 1024};

// Smallest and largest size of the sweep. Quick runs measure every fourth power of two.
constexpr double kSmallest = 0.125, kLargest = 8192;

class TuningRun {
 public:
  TuningRun(const Options& options, const Progress& progress, Report& report)
      : options_(options), progress_(progress), report_(report), count_(options.quick ? 1000 : 10'000) {}

  absl::Status run() {
    program_ = serving::program_beside("locus");
    if (program_.empty()) return absl::UnavailableError("there is no locus beside this program; build it too");
    ASSIGN_OR_RETURN(daemon_, Daemon::start());
    for (const TuningCase& one : kTuningCases) {
      if (!wanted(one)) continue;
      RETURN_IF_ERROR(run_case(one));
    }
    return absl::OkStatus();
  }

 private:
  absl::Span<const double> presents() const {
    return absl::MakeConstSpan(kPresentSizes).first(options_.quick ? 1 : std::size(kPresentSizes));
  }

  std::string case_name(const char* what, const TuningCase& one, double present) const {
    const std::string from = present == 0 ? "chosen" : absl::StrCat(present);
    return absl::StrCat(what, "/", one.name, "/", dynamic::name_of_count(count_), "/from_", from);
  }

  bool wanted(const TuningCase& one, double present) const {
    return options_.filter.wants(case_name("named", one, present)) ||
           options_.filter.wants(case_name("promise", one, present));
  }
  bool wanted(const TuningCase& one) const {
    return std::any_of(presents().begin(), presents().end(), [&](double present) { return wanted(one, present); });
  }

  absl::Status run_case(const TuningCase& one) {
    progress_(absl::StrCat("the scene of ", one.name));
    // The second scene stays as it is, so that both can be asked in turns.
    for (const char* scene : {"tuned", "untuned"}) RETURN_IF_ERROR(make_scene(one, scene));
    ASSIGN_OR_RETURN(const AroundObjects queries,
                     around_objects(daemon_->client(), "tuned", one.kinds, one.radius, options_.quick ? 128 : 1024));
    ASSIGN_OR_RETURN(files_, write_rows(queries, folder_.file("")));
    batches_ = batches_of(queries);
    for (const double present : presents()) {
      if (!wanted(one, present)) continue;
      progress_(absl::StrCat(one.name, ": locus tune ", case_name("from", one, present)));
      RETURN_IF_ERROR(tune_from(one, present));
    }
    return absl::OkStatus();
  }

  absl::Status make_scene(const TuningCase& one, const std::string& scene) {
    v1::DeleteSceneRequest remove;
    remove.set_name(scene);
    daemon_->client().delete_scene(remove).IgnoreError();  // of the case before
    if (!one.kind) return demo(scene);
    v1::CreateSceneRequest create;
    create.set_name(scene);
    RETURN_IF_ERROR(daemon_->client().create_scene(create).status());
    dynamic::World world(*one.kind, count_);
    RETURN_IF_ERROR(daemon_->client().apply(scene, serving::insert_all(world)).status());
    for (const v1::StreamUpdatesRequest& moves : serving::move_messages(world, scene, count_, kTicksBefore))
      RETURN_IF_ERROR(daemon_->client().apply(scene, moves.batch()).status());
    return absl::OkStatus();
  }

  // Leaves the scene of the quickstart's demo, with the level of options.levels or a generated city.
  absl::Status demo(const std::string& scene) {
    const std::string level = options_.levels + "/pak1-maps.pk3";
    std::vector<std::string> words = {"demo",      "--scene", scene,      "--objects", absl::StrCat(count_),
                                      "--seconds", "0.5",     "--checks", "1",         "--edge-rays",
                                      "100"};
    if (!options_.quick && std::filesystem::exists(level)) {
      words.insert(words.end(), {level, "--entry", "maps/delta.bsp"});
    } else if (scene == "tuned") {
      report_.notes.push_back("level: a generated city instead of the quickstart's level; see fetch_levels.sh");
    }
    return call(std::move(words)).status();
  }

  // Runs `locus` with these words and returns its output.
  absl::StatusOr<std::string> call(std::vector<std::string> words) {
    words.insert(words.begin(), {"locus", "--address", daemon_->address(), "-o", "json"});
    const std::string log = folder_.file("output");
    ASSIGN_OR_RETURN(const std::unique_ptr<Process> process, Process::start(program_, words, log));
    constexpr double kLook = 0.01;
    for (double waited = 0; waited < kProgramSeconds && !process->has_ended(); waited += kLook)
      serving::sleep_seconds(kLook);
    const std::string output = serving::text_of_file(log);
    if (!process->has_ended() || process->exit_code() != 0)
      return absl::InternalError(absl::StrCat("locus ", words[5], " failed: ", output));
    return output;
  }

  absl::StatusOr<json> tune(std::vector<std::string> more) {
    std::vector<std::string> words = {"tune", "tuned", "--rounds", absl::StrCat(options_.quick ? 1 : options_.rounds)};
    for (const std::string& file : files_) words.insert(words.end(), {"--queries", file});
    words.insert(words.end(), more.begin(), more.end());
    ASSIGN_OR_RETURN(const std::string output, call(std::move(words)));
    json report = json::parse(output, nullptr, /*allow_exceptions=*/false);
    if (!report.is_object()) return absl::InternalError(absl::StrCat("locus tune wrote no report: ", output));
    return report;
  }

  // Returns the option that measures all sizes, of which `named` is one.
  std::vector<std::string> swept_words(double named) const {
    std::string sizes = absl::StrCat(named);
    for (double size = kSmallest; size <= kLargest; size *= options_.quick ? 16 : 2) absl::StrAppend(&sizes, ",", size);
    return {"--sizes", sizes};
  }

  absl::Status set_cell_size(const std::string& scene, double cell_size) {
    v1::UpdateSceneRequest request;
    request.set_name(scene);
    request.add_fields("cell_size");
    request.set_cell_size(cell_size);
    RETURN_IF_ERROR(daemon_->client().update_scene(request).status());
    return settle(scene);
  }

  // Moves an object to and fro, since each batch that changes something refiles some objects.
  absl::Status settle(const std::string& scene) {
    v1::UpdateBatch batch;
    v1::DumpSceneRequest request;
    request.set_scene(scene);
    RETURN_IF_ERROR(daemon_->client().dump(request, [&batch](const v1::DumpSceneResponse& message) {
      if (message.objects().empty() || !batch.moves().empty()) return absl::OkStatus();
      const v1::Insert& run = message.objects(0);
      v1::Move& move = *batch.add_moves();
      move.add_ids(run.ids(0));
      for (int axis = 0; axis < 3; ++axis) move.add_positions_f64(run.positions_f64(axis));
      return absl::OkStatus();
    }));
    const double x = batch.moves(0).positions_f64(0);
    for (uint64_t i = 0; i < kSettlingBatches; ++i) {
      batch.mutable_moves(0)->set_positions_f64(0, i % 2 == 0 ? x + 1 : x);
      RETURN_IF_ERROR(daemon_->client().apply(scene, batch).status());
    }
    return absl::OkStatus();
  }

  absl::Status tune_from(const TuningCase& one, double present) {
    for (const char* scene : {"tuned", "untuned"}) RETURN_IF_ERROR(set_cell_size(scene, present));
    ASSIGN_OR_RETURN(const json report, tune({"--apply"}));
    RETURN_IF_ERROR(settle("tuned"));
    ASSIGN_OR_RETURN(const double kept, relative_time());
    const bool applied = report["applied"];
    // A gain that is too small to change anything promises that nothing changes.
    const double promised = applied ? 1 - report["gain_percent"].get<double>() / 100 : 1;
    ASSIGN_OR_RETURN(const v1::GetSceneResponse tuned, daemon_->client().describe_scene("tuned"));
    const double size = tuned.description().objects().cell_size();
    progress_(absl::StrCat("all cell sizes of ", one.name));
    ASSIGN_OR_RETURN(const json sweep, tune(swept_words(size)));
    ASSIGN_OR_RETURN(const double named_time, swept_time(sweep, size));
    double best_time = std::numeric_limits<double>::infinity();
    for (const json& row : sweep["sizes"]) best_time = std::min(best_time, row["time"].get<double>());

    Cell named;
    named.suite = "tuning";
    named.case_name = case_name("named", one, present);
    named.metric = "relative time";
    named.ours = named_time;
    named.peer = best_time;
    named.peer_name = "best_of_sweep";
    named.ratio = best_time / named_time;
    named.results_hash = hash_of_number(count_);
    Cell promise = named;
    promise.case_name = case_name("promise", one, present);
    promise.ours = kept;
    promise.peer = promised;
    promise.peer_name = "promised";
    promise.ratio = std::min(kept / promised, promised / kept);
    if (options_.filter.wants(named.case_name)) {
      report_.add(named);
      note_bar(report_, 1 / (1 + kTolerance), absl::StrFormat(", cell size %g", size));
    }
    if (options_.filter.wants(promise.case_name)) {
      report_.add(promise);
      note_bar(report_, 1 / (1 + kTolerance));
    }
    return absl::OkStatus();
  }

  // Returns the time of a cell size in the sweep.
  static absl::StatusOr<double> swept_time(const json& sweep, double size) {
    for (const json& row : sweep["sizes"])
      if (row["cell_size"].get<double>() == size) return row["time"].get<double>();
    return absl::InternalError(absl::StrCat("the sweep has no cells of ", size));
  }

  // Returns the time of the queries at the tuned scene, relative to the other one: the median of rounds in turns.
  absl::StatusOr<double> relative_time() {
    std::vector<double> ratios;
    for (int round = 0; round <= 2 * options_.rounds; ++round) {  // the first is not counted
      ASSIGN_OR_RETURN(const double tuned, nanoseconds_of("tuned"));
      ASSIGN_OR_RETURN(const double untuned, nanoseconds_of("untuned"));
      if (round > 0) ratios.push_back(tuned / untuned);
    }
    return median(ratios);
  }

  absl::StatusOr<double> nanoseconds_of(const std::string& scene) {
    double sum = 0;
    for (const v1::QueryBatch& batch : batches_) {
      ASSIGN_OR_RETURN(const v1::QueryResult result, daemon_->client().query(scene, batch));
      sum += static_cast<double>(result.work().nanoseconds());
    }
    return std::max(sum, 1.0);
  }

  const Options& options_;
  const Progress& progress_;
  Report& report_;
  const uint32_t count_;
  const TemporaryFolder folder_;
  std::string program_;  // path of locus
  std::unique_ptr<Daemon> daemon_;
  std::vector<std::string> files_;
  std::vector<v1::QueryBatch> batches_;
};

}  // namespace

absl::Status run_tuning_suite(const Options& options, const Progress& progress, Report& report) {
  return TuningRun(options, progress, report).run();
}

}  // namespace locus::bench::tuning
