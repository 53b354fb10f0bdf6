#include "client/cli/extras/tune/query_turns.h"

#include <algorithm>
#include <cmath>

#include "client/cli/extras/verify/answer_comparison.h"
#include "client/cli/failure.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

// Cost of a turn: at least, by repeats, and at most, by leaving out batches.
constexpr double kMinTurnNanoseconds = 2e7, kMaxTurnNanoseconds = 2e8;
constexpr double kMaxRepeats = 200;

// Costs of one turn, summed over its queries.
struct TurnCost {
  double nanoseconds = 0;
  double work = 0;
  double queries = 0;
};
using TurnCosts = std::map<std::string, TurnCost>;

// Batches that are asked in every turn, and how often.
struct TurnPlan {
  std::vector<const QuerySet::Entry*> entries;
  int repeats = 1;
};

// Returns every `stride`-th batch of each kind.
std::vector<const QuerySet::Entry*> thinned(const QuerySet& queries, size_t stride) {
  std::vector<const QuerySet::Entry*> entries;
  std::map<std::string, size_t> passed;
  for (const QuerySet::Entry& entry : queries.batches()) {
    if (passed[kind_of(entry.batch)]++ % stride == 0) entries.push_back(&entry);
  }
  return entries;
}

absl::StatusOr<TurnCosts> turn(const client::Client& client, const std::string& scene, const TurnPlan& plan) {
  TurnCosts costs;
  for (int i = 0; i < plan.repeats; ++i) {
    for (const QuerySet::Entry* const entry : plan.entries) {
      const v1::QueryBatch& batch = entry->batch;
      const absl::StatusOr<v1::QueryResult> result = client.query(scene, batch);
      if (!result.ok()) return with_place(result.status(), entry->place);
      if (result->blocks_size() != batch.blocks_size())
        return absl::DataLossError("an answer does not have one result for each block");
      for (int block = 0; block < batch.blocks_size(); ++block) {
        const v1::Work& work = result->blocks(block).work();
        TurnCost& cost = costs[kind_name(batch.blocks(block))];
        cost.nanoseconds += static_cast<double>(work.nanoseconds());
        cost.work += static_cast<double>(work.nodes() + work.cells() + work.tests());
        cost.queries += static_cast<double>(query_count(batch.blocks(block)));
      }
    }
  }
  return costs;
}

double nanoseconds_of(const TurnCosts& costs) {
  double sum = 1;
  for (const auto& [kind, cost] : costs) sum += cost.nanoseconds;
  return sum;
}

// Asks every scene once, as a warm-up, and returns the plan for all turns: the slowest scene needs no more than
// kMaxTurnNanoseconds, if one batch of each kind does not, and the fastest at least kMinTurnNanoseconds.
absl::StatusOr<TurnPlan> warm_up(const client::Client& client, const std::vector<std::string>& scenes,
                                 const QuerySet& queries) {
  size_t stride = 1;
  TurnPlan plan = {thinned(queries, stride)};
  double fastest = kMinTurnNanoseconds, slowest = 1;
  for (const std::string& scene : scenes) {
    ASSIGN_OR_RETURN(const TurnCosts costs, turn(client, scene, plan));
    const double nanoseconds = nanoseconds_of(costs);
    fastest = std::min(fastest, nanoseconds);
    slowest = std::max(slowest, nanoseconds);
    if (nanoseconds <= kMaxTurnNanoseconds) continue;
    stride *= static_cast<size_t>(std::ceil(nanoseconds / kMaxTurnNanoseconds));
    plan.entries = thinned(queries, stride);
  }
  if (stride == 1) {
    const double wanted = std::min(std::ceil(kMinTurnNanoseconds / fastest), kMaxRepeats);
    plan.repeats = static_cast<int>(std::clamp(std::floor(kMaxTurnNanoseconds / slowest), 1.0, wanted));
  }
  return plan;
}

}  // namespace

double median(std::vector<double> values) {
  LOCUS_CHECK(!values.empty());
  std::sort(values.begin(), values.end());
  const size_t half = values.size() / 2;
  return values.size() % 2 != 0 ? values[half] : (values[half - 1] + values[half]) / 2;
}

absl::StatusOr<std::vector<KindCosts>> ask_in_turns(const client::Client& client,
                                                    const std::vector<std::string>& scenes, const QuerySet& queries,
                                                    int rounds, const std::function<void(int done)>& on_round) {
  std::vector<std::map<std::string, std::vector<double>>> nanoseconds(scenes.size());
  std::vector<KindCosts> costs(scenes.size());
  ASSIGN_OR_RETURN(const TurnPlan plan, warm_up(client, scenes, queries));
  for (int round = 1; round <= rounds; ++round) {
    for (size_t i = 0; i < scenes.size(); ++i) {
      ASSIGN_OR_RETURN(const TurnCosts turned, turn(client, scenes[i], plan));
      for (const auto& [kind, cost] : turned) {
        if (cost.queries == 0) continue;
        nanoseconds[i][kind].push_back(cost.nanoseconds / cost.queries);
        costs[i][kind].work = cost.work / cost.queries;
      }
    }
    on_round(round);
  }
  for (size_t i = 0; i < scenes.size(); ++i)
    for (auto& [kind, values] : nanoseconds[i]) costs[i][kind].nanoseconds = median(values);
  return costs;
}

}  // namespace locus::cli
