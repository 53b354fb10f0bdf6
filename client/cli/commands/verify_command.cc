#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/commands/query_input.h"
#include "client/cli/default_scene.h"
#include "client/cli/extras/verify/answer_comparison.h"
#include "client/cli/extras/verify/random_queries.h"
#include "client/cli/failure.h"
#include "client/cli/output.h"
#include "client/cli/progress.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kDefaultSeconds = 10, kMaxSeconds = 86400;
// Deadline of a call if --timeout is not given: a batch by list may take long.
constexpr double kCallSeconds = 600;
// Time that a batch of random queries should take by list, and the limits of the number of its queries.
constexpr double kBatchSeconds = 0.5;
constexpr uint32_t kMaxQueries = 256;
// Maximum number of attempts for a batch whose revision is dropped before it was queried by list.
constexpr int kAttempts = 100;

struct VerifyOptions {
  std::string scene;
  std::optional<std::string> queries;  // path of the input
  std::string kind;                    // kind of the queries in the input; empty: known by its columns
  std::optional<double> seconds;
  uint64_t seed = 1;
};

// Asks each batch twice at one revision, by the structures and by list, and compares the bytes of the answers.
class Verifier {
 public:
  Verifier(const client::Client& client, std::string scene, std::optional<Clock::time_point> end,
           ProgressWriter& progress)
      : client_(client), scene_(std::move(scene)), end_(end), progress_(progress) {}

  bool is_over() const { return end_ && Clock::now() >= *end_; }

  // Verifies one batch. `place` says in messages where the batch is from. Returns INTERNAL for a difference, and the
  // errors of the calls.
  absl::Status verify(v1::QueryBatch batch, const std::string& place) {
    for (int attempt = 1;; ++attempt) {
      batch.clear_view();
      batch.set_by_list(false);
      ASSIGN_OR_RETURN(answer_, client_.query(scene_, batch));
      batch.mutable_view()->set_exactly(answer_.revision());
      batch.mutable_view()->set_epoch(answer_.epoch());
      batch.set_by_list(true);
      const Clock::time_point begin = Clock::now();
      const absl::StatusOr<v1::QueryResult> listed = client_.query(scene_, batch);
      // Updates may have replaced the revision meanwhile; then the batch is asked again at a newer one.
      if (absl::IsOutOfRange(listed.status()) && attempt < kAttempts) continue;
      RETURN_IF_ERROR(listed.status());
      list_seconds_ = std::chrono::duration<double>(Clock::now() - begin).count();
      count(batch);
      const std::optional<AnswerDifference> difference = first_difference(batch, answer_, *listed);
      if (difference) return refusal(batch, *listed, *difference, place);
      progress_.update(queries_);
      return absl::OkStatus();
    }
  }

  // Returns the answer to the last batch, and the time that the same batch took by list.
  const v1::QueryResult& answer() const { return answer_; }
  double list_seconds() const { return list_seconds_; }
  uint64_t queries() const { return queries_; }

  Report report(const VerifyOptions& options) const {
    Report report;
    report.head = {{"scene", scene_},
                   {"batches", batches_},
                   {"queries", queries_},
                   {"differences", 0},
                   {"first_revision", first_revision_},
                   {"last_revision", answer_.revision()},
                   {"epoch", id_json(answer_.epoch())}};
    if (!options.queries) report.head["seed"] = options.seed;
    report.rows_name = "kinds";
    report.keys = {"kind", "queries"};
    // A row of 0 shows that random queries of pairs were left out.
    if (!options.queries && !kinds_.contains("pairs")) report.rows.push_back({{"kind", "pairs"}, {"queries", 0}});
    for (const auto& [kind, queries] : kinds_) report.rows.push_back({{"kind", kind}, {"queries", queries}});
    return report;
  }

 private:
  void count(const v1::QueryBatch& batch) {
    if (batches_++ == 0) first_revision_ = answer_.revision();
    for (const v1::QueryBlock& block : batch.blocks()) {
      kinds_[kind_name(block)] += query_count(block);
      queries_ += query_count(block);
    }
  }

  absl::Status refusal(const v1::QueryBatch& batch, const v1::QueryResult& listed, const AnswerDifference& difference,
                       const std::string& place) const {
    const auto block = static_cast<int>(difference.block);
    const std::string kind = block < batch.blocks_size() ? kind_name(batch.blocks(block)) : "none";
    std::string text = absl::StrCat("the answers differ at revision ", answer_.revision(), ", ", place, ", block ",
                                    difference.block, " (", kind, ")");
    if (difference.query) absl::StrAppend(&text, ", query ", *difference.query);
    absl::StrAppend(&text, ": ", difference.column, " by the structures are not those by list");
    if (difference.query && block < listed.blocks_size()) {
      const auto query = static_cast<int>(*difference.query);
      const v1::BlockResult &first = answer_.blocks(block), &second = listed.blocks(block);
      if (query < first.counts_size() && query < second.counts_size())
        absl::StrAppend(&text, " (", first.counts(query), " and ", second.counts(query), " rows)");
    }
    return absl::InternalError(text);
  }

  const client::Client& client_;
  const std::string scene_;
  const std::optional<Clock::time_point> end_;
  ProgressWriter& progress_;
  v1::QueryResult answer_;
  double list_seconds_ = 0;
  uint64_t batches_ = 0;
  uint64_t queries_ = 0;
  uint64_t first_revision_ = 0;
  std::map<std::string, uint64_t> kinds_;
};

absl::Status verify_random(const VerifyOptions& options, const client::Client& client, Verifier& verifier) {
  ASSIGN_OR_RETURN(v1::Scene scene, client.get_scene(options.scene));
  RandomQueries random(scene, options.seed);
  double queries = 1;
  for (uint64_t number = 1; number == 1 || !verifier.is_over(); ++number) {
    RETURN_IF_ERROR(verifier.verify(random.next(static_cast<uint32_t>(queries)),
                                    absl::StrCat("batch ", number, " of seed ", options.seed)));
    random.learn_ids(verifier.answer());
    const double factor = kBatchSeconds / std::max(verifier.list_seconds(), 1e-6);
    queries = std::clamp(queries * std::clamp(factor, 0.25, 2.0), 1.0, double{kMaxQueries});
  }
  return absl::OkStatus();
}

// Verifies the rows of an input.
absl::Status verify_input(const VerifyOptions& options, Verifier& verifier, Context& context) {
  bool is_over = false;
  const QueryInput input = {*options.queries, options.kind};
  const absl::Status status =
      for_each_query_batch(input, options.scene, context, [&](v1::QueryBatch batch, const std::string& lines) {
        if (verifier.is_over()) {
          is_over = true;
          return absl::CancelledError("the time is over");
        }
        return verifier.verify(std::move(batch), lines);
      });
  return is_over ? absl::OkStatus() : status;
}

// Servers without by_list ignore it, so that their answers would always be equal.
absl::Status check_served(const client::Client& client) {
  ASSIGN_OR_RETURN(const v1::GetServerResponse server, client.get_server());
  const auto& features = server.features();
  if (std::find(features.begin(), features.end(), "by_list") != features.end()) return absl::OkStatus();
  return absl::UnimplementedError(absl::StrCat("the server at ", client.address(), " does not serve by_list"));
}

absl::Status verify(const VerifyOptions& options, Context& context) {
  if (!options.kind.empty() && !options.queries) return usage_error("--kind needs --queries");
  if (!context.options().timeout_seconds) context.options().timeout_seconds = kCallSeconds;
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  RETURN_IF_ERROR(check_served(*client));
  std::optional<Clock::time_point> end;
  if (options.seconds || !options.queries)
    end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                             std::chrono::duration<double>(options.seconds.value_or(kDefaultSeconds)));
  ProgressWriter progress = start_progress(context);
  progress.begin({.action = "verifying", .subject = options.scene, .unit = "queries"});
  Verifier verifier(*client, options.scene, end, progress);
  const absl::Status status =
      options.queries ? verify_input(options, verifier, context) : verify_random(options, *client, verifier);
  progress.hide();
  RETURN_IF_ERROR(status);
  context.write(verifier.report(options));
  return absl::OkStatus();
}

}  // namespace

void add_verify_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<VerifyOptions>();
  CLI::App& command =
      *parent.add_subcommand("verify", "Verify that a scene's structures give the answers of a plain list");
  command.footer(
      R"(Asks each batch of queries twice at one revision: as usual, and by list, which tests every triangle and object and uses
no structure. The bytes of both answers must be equal. Without --queries, random queries of every kind are asked, among
them about the past if the scene has one; pairs only of up to 300 objects, since by list each is tested against each. The
first difference ends the command with exit code 1 and is named.
Examples:
  locus verify arena
  locus verify arena --seconds 60 --seed 7
  locus verify arena --queries rays.csv
  locus verify arena --queries points.ndjson --kind contains

Rows are those of `locus query KIND`: .csv has a header line, any other file a JSON object a line. Without --kind, the
columns name it: dir a ray, radius a ball, half a box, way a sweep, viewer sight, view a frustum, at nearest.)");
  add_scene_argument(command, options->scene);
  command.add_option("--queries", options->queries, "Rows to ask; - is standard input [random queries of all kinds]")
      ->type_name("FILE");
  add_input_kind_option(command, options->kind);
  command
      .add_option("--seconds", options->seconds, "How long at most [10; with --queries until all rows are verified]")
      ->type_name("SECONDS")
      ->check(CLI::Range(0.01, kMaxSeconds).description(""));
  command.add_option("--seed", options->seed, "Seed of the random queries [1]")->type_name("N");
  run_when_chosen(command, options, context, verify);
}

}  // namespace locus::cli
