// `locus tune`: finds the cell size with which a scene answers its queries fastest, in scratch copies of the scene.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/commands/query_input.h"
#include "client/cli/default_scene.h"
#include "client/cli/extras/tune/cancel_on_signal.h"
#include "client/cli/extras/tune/cell_tuning.h"
#include "client/cli/extras/tune/structure_values.h"
#include "client/cli/extras/tune/tune_report.h"
#include "client/cli/failure.h"
#include "client/cli/output.h"
#include "client/cli/progress.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

// Deadline of a call if --timeout is not given: a batch of heavy queries, or of many inserts, may take long.
constexpr double kTuneCallSeconds = 600;
constexpr uint64_t kMaxBatchBytes = 16u << 20;
constexpr uint64_t kSampledObjects = 4096;  // around which queries are made

struct TuneOptions {
  std::string scene;
  std::vector<std::string> queries;  // paths
  std::string kind;
  std::vector<double> sizes;
  int rounds = 7;
  uint64_t seed = 1;
  bool apply = false;
  bool structures = false;
};

absl::Status check(const TuneOptions& options) {
  if (!options.kind.empty() && options.queries.empty()) return usage_error("--kind needs --queries");
  for (const double size : options.sizes) {
    const double exponent = std::log2(size);
    if (!(size > 0) || exponent != std::round(exponent) || exponent < kMinExponent || exponent > kMaxExponent)
      return usage_error(
          absl::StrCat("--sizes takes powers of two from 2^", kMinExponent, " to 2^", kMaxExponent, ", not ", size));
  }
  return absl::OkStatus();
}

absl::Status check_served(const v1::GetServerResponse& server, const client::Client& client) {
  const auto& features = server.features();
  for (const char* const feature : {"cell_size", "idle_ttl", "static_from"})
    if (std::find(features.begin(), features.end(), feature) == features.end())
      return absl::UnimplementedError(absl::StrCat("the server at ", client.address(), " does not serve ", feature));
  return absl::OkStatus();
}

uint64_t batch_bytes(const v1::GetServerResponse& server) {
  for (const v1::Limit& limit : server.limits())
    if (limit.name() == "receive_bytes") return std::min(kMaxBatchBytes, static_cast<uint64_t>(limit.value() / 2));
  return kMaxBatchBytes;
}

class Tune {
 public:
  Tune(const TuneOptions& options, Context& context)
      : options_(options), context_(context), progress_(start_progress(context)) {}

  absl::Status run() {
    const absl::Status status = run_to_end();
    if (status.ok() || !is_cancelled()) return status;
    return absl::CancelledError(absl::StrCat("interrupted; the scratch scenes were deleted, and ",
                                             is_setting_ ? "the cell size may have been set" : "nothing was changed"));
  }

 private:
  absl::Status run_to_end() {
    RETURN_IF_ERROR(read_queries());
    ASSIGN_OR_RETURN(client_, context_.connect());
    // Not before, because nothing cancels the reading of a file.
    signal_.emplace([this] { context_.cancel_calls(); });
    ASSIGN_OR_RETURN(const v1::GetServerResponse server, client_->get_server());
    RETURN_IF_ERROR(check_served(server, *client_));
    ASSIGN_OR_RETURN(scene_, client_->describe_scene(options_.scene));
    RETURN_IF_ERROR(check_scene());
    if (has_objects()) RETURN_IF_ERROR(check_room(server));
    RETURN_IF_ERROR(objects_.dump(*client_, options_.scene, batch_bytes(server), progress_));
    if (has_objects() && objects_.objects() == 0)
      return absl::FailedPreconditionError(
          absl::StrCat("scene ", options_.scene, " has lost all its objects meanwhile"));
    RETURN_IF_ERROR(make_queries());
    if (has_objects()) RETURN_IF_ERROR(tune_cell_size());
    if (options_.structures) RETURN_IF_ERROR(time_structures());
    RETURN_IF_ERROR(apply());
    progress_.hide();
    write();
    return absl::OkStatus();
  }

  bool has_objects() const { return scene_.scene().objects() > 0; }

  // Reads the queries before anything is asked of the server.
  absl::Status read_queries() {
    for (const std::string& path : options_.queries) {
      progress_.begin({.action = "reading", .subject = path, .unit = "queries"});
      RETURN_IF_ERROR(for_each_query_batch({path, options_.kind}, options_.scene, context_,
                                           [this](v1::QueryBatch batch, const std::string& lines) {
                                             queries_.add(std::move(batch), lines);
                                             progress_.update(queries_.added());
                                             return absl::OkStatus();
                                           }));
    }
    return absl::OkStatus();
  }

  absl::Status check_scene() const {
    if (has_objects() || (options_.structures && scene_.scene().triangles() > 0)) return absl::OkStatus();
    return absl::FailedPreconditionError(
        absl::StrCat("scene ", options_.scene, " has no objects, so there is nothing ", "to tune"));
  }

  absl::Status check_room(const v1::GetServerResponse& server) const {
    ASSIGN_OR_RETURN(const std::vector<v1::IdentityQuotas> quotas, client_->get_quotas());
    return locus::cli::check_room(scratch_need(scene_, cell_options()), server, quotas);
  }

  absl::Status make_queries() {
    if (!options_.queries.empty()) return absl::OkStatus();
    std::vector<std::array<double, 3>> positions = objects_.positions(kSampledObjects);
    if (positions.empty())  // a scene without objects: around its instances
      for (const v1::Placement& run : objects_.instances())
        for (int i = 0; i + 2 < run.translations_size(); i += 3)
          positions.push_back({run.translations(i), run.translations(i + 1), run.translations(i + 2)});
    if (positions.empty()) return absl::FailedPreconditionError(absl::StrCat("scene ", options_.scene, " is empty"));
    ASSIGN_OR_RETURN(queries_, typical_queries(*client_, scene_.scene(), positions, options_.seed));
    return absl::OkStatus();
  }

  CellTuningOptions cell_options() const {
    return {options_.sizes, options_.rounds, options_.queries.empty() ? Mix::kAlike : Mix::kAsAsked};
  }

  absl::Status tune_cell_size() {
    // Deletions have a connection of their own, whose calls nobody cancels.
    ASSIGN_OR_RETURN(const std::unique_ptr<client::Client> cleaner, context_.open_connection());
    ASSIGN_OR_RETURN(const CellTuningResult result,
                     tune_cells(*client_, *cleaner, scene_, objects_, queries_, cell_options(), progress_));
    cells_ = cell_report(options_.scene, result);
    cells_.head["revision"] = objects_.revision();
    cells_.head["queries"] = queries_.added();
    advice_.push_back(advice(options_.scene, result));
    if (options_.apply) cells_.head["applied"] = !result.choice.leave_it;
    if (!result.choice.leave_it) better_size_ = result.choice.cell_size;
    return absl::OkStatus();
  }

  // Sets the named cell size, as the last step, so that nothing is changed if a step before fails.
  absl::Status apply() {
    if (!options_.apply || !better_size_) return absl::OkStatus();
    is_setting_ = true;
    v1::UpdateSceneRequest request;
    request.set_name(options_.scene);
    request.add_fields("cell_size");
    request.set_cell_size(*better_size_);
    RETURN_IF_ERROR(client_->update_scene(request).status());
    advice_.back() += "; it was set";
    return absl::OkStatus();
  }

  bool is_cancelled() const { return signal_ && signal_->is_cancelled(); }

  absl::Status time_structures() {
    const v1::Vec3d &low = scene_.scene().min(), &high = scene_.scene().max();
    const Vec3d frame = {low.x() / 2 + high.x() / 2, low.y() / 2 + high.y() / 2, low.z() / 2 + high.z() / 2};
    const FamilyQueries queries = family_queries(queries_, frame);
    if (queries.rays.empty() && queries.balls.empty() && queries.boxes.empty() && queries.nearest.empty())
      return usage_error("--structures times rays, balls, boxes and nearest, and --queries has none of them");
    const FamilyOptions options = {.rounds = options_.rounds};
    std::vector<StructureTable> tables;
    ASSIGN_OR_RETURN(const std::vector<PlacedShape> shapes, shapes_of(objects_, frame));
    if (!shapes.empty()) {
      ASSIGN_OR_RETURN(std::vector<StructureFigures> figures,
                       time_shapes(shapes, queries, options, family_progress("objects")));
      tables.push_back({"objects", shapes.size(), std::move(figures)});
    }
    ASSIGN_OR_RETURN(const std::vector<Triangle> triangles, triangles_of(*client_, objects_, frame, progress_));
    if (!triangles.empty()) {
      ASSIGN_OR_RETURN(std::vector<StructureFigures> figures,
                       time_triangles(triangles, queries, options, family_progress("triangles")));
      tables.push_back({"triangles", triangles.size(), std::move(figures)});
    }
    for (const StructureTable& table : tables) best_.push_back(best_sentence(table));
    structures_ = structure_report(options_.scene, tables);
    return absl::OkStatus();
  }

  FamilyProgress family_progress(const char* values) {
    progress_.begin({.action = "timing", .subject = absl::StrCat("structures of ", values), .unit = "steps"});
    return [this](uint64_t done, uint64_t total) {
      progress_.update(done, total);
      return is_cancelled() ? absl::CancelledError("interrupted") : absl::OkStatus();
    };
  }

  // Writes a table below which are its sentences.
  void write_table(Report report, const std::vector<std::string>& sentences) {
    report.head = Json::object();
    context_.write(report);
    for (const std::string& sentence : sentences) context_.out() << sentence << '\n';
  }

  // Writes the tables one after another, and in other formats one report.
  void write() {
    if (context_.format() == Format::kTable) {
      if (!advice_.empty()) write_table(cells_, advice_);
      if (!advice_.empty() && !best_.empty()) context_.out() << '\n';
      if (!best_.empty()) write_table(structures_, best_);
      return;
    }
    Report report = cells_;
    report.rows_name = "sizes";
    report.head["advice"] = advice_.empty() ? Json(nullptr) : Json(advice_.front());
    if (!best_.empty()) {
      report.head.update(structures_.head);
      if (context_.format() == Format::kJson) {
        report.head["structures"] = structures_.rows;
      } else {
        report.rows.insert(report.rows.end(), structures_.rows.begin(), structures_.rows.end());
      }
    }
    context_.write(report);
  }

  const TuneOptions& options_;
  Context& context_;
  ProgressWriter progress_;
  std::optional<CancelOnSignal> signal_;
  client::Client* client_ = nullptr;
  QuerySet queries_;
  v1::GetSceneResponse scene_;
  ObjectBatches objects_;
  std::optional<double> better_size_;  // none: leave it
  bool is_setting_ = false;
  Report cells_, structures_;
  std::vector<std::string> advice_, best_;  // sentences below the two tables; none = no table
};

absl::Status tune(const TuneOptions& options, Context& context) {
  RETURN_IF_ERROR(check(options));
  if (!context.options().timeout_seconds) context.options().timeout_seconds = kTuneCallSeconds;
  return Tune(options, context).run();
}

}  // namespace

void add_tune_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<TuneOptions>();
  CLI::App& command = *parent.add_subcommand(
      "tune", "Measure with which cell size a scene answers queries fastest, and say what to set");
  command.footer(
      R"(Makes scratch scenes on the server with the objects and instances of the scene and other cell sizes, asks them your own
queries in turns, and deletes them, also after an error or Ctrl-C. Times are processor times that the server measures, so
the way to the server does not count. The scene itself is only read, unless --apply is given and 10 % or more are gained.
Without --queries, rays, balls, boxes and nearest queries are made around the objects, and each kind counts alike. Moves
are not measured: very small cells make them dearer. Objects get cells of a new size with the next batches of updates, a few
thousand with each.
Examples:
  locus tune arena
  locus tune arena --queries rays.csv --queries balls.ndjson --apply
  locus tune arena --sizes 0.5,1,2,4,8,16,32
  locus tune arena --structures

Rows are those of `locus query KIND`, and their kind is known as by `locus verify`. time is relative to the present size.
--structures also times the structures of the library locus::index on the scene's objects and triangles, in this process.)");
  add_scene_argument(command, options->scene);
  add_repeatable(command, "--queries", options->queries, "FILE",
                 "Rows to ask; - is standard input [made of the scene]");
  add_input_kind_option(command, options->kind);
  command.add_option("--sizes", options->sizes, "Cell sizes to measure, powers of two [a search around the present]")
      ->type_name("SIZE,...")
      ->delimiter(',')
      ->allow_extra_args(false);
  command.add_option("--rounds", options->rounds, "Rounds whose median counts [7]")
      ->type_name("N")
      ->check(CLI::Range(1, 1000).description(""));
  command.add_option("--seed", options->seed, "Seed of the made queries [1]")->type_name("N");
  command.add_flag("--apply", options->apply, "Set the named cell size");
  command.add_flag("--structures", options->structures, "Also time the structures of locus::index here");
  run_when_chosen(command, options, context, tune);
}

}  // namespace locus::cli
