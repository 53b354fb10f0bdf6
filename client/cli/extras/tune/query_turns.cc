#include "client/cli/extras/tune/query_turns.h"

#include <algorithm>
#include <cmath>

#include "client/cli/extras/verify/answer_comparison.h"
#include "client/cli/failure.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr double kTurnNanoseconds = 2e7;
constexpr double kMaxRepeats = 200;

// Costs of one turn, summed over its queries.
struct TurnCost {
  double nanoseconds = 0;
  double work = 0;
  double queries = 0;
};
using TurnCosts = std::map<std::string, TurnCost>;

absl::StatusOr<TurnCosts> turn(const client::Client& client, const std::string& scene, const QuerySet& queries,
                               int repeats) {
  TurnCosts costs;
  for (int i = 0; i < repeats; ++i) {
    for (const auto& [batch, place] : queries.batches()) {
      const absl::StatusOr<v1::QueryResult> answer = client.query(scene, batch);
      if (!answer.ok()) return with_place(answer.status(), place);
      const v1::QueryResult& result = *answer;
      if (result.blocks_size() != batch.blocks_size())
        return absl::DataLossError("an answer does not have one result for each block");
      for (int block = 0; block < batch.blocks_size(); ++block) {
        const v1::Work& work = result.blocks(block).work();
        TurnCost& cost = costs[kind_name(batch.blocks(block))];
        cost.nanoseconds += static_cast<double>(work.nanoseconds());
        cost.work += static_cast<double>(work.nodes() + work.cells() + work.tests());
        cost.queries += static_cast<double>(query_count(batch.blocks(block)));
      }
    }
  }
  return costs;
}

// Returns the number of times to ask the batches in a turn, if asking them once costs `once`.
int repeats_for(const TurnCosts& once) {
  double nanoseconds = 1;
  for (const auto& [kind, cost] : once) nanoseconds += cost.nanoseconds;
  return static_cast<int>(std::clamp(std::ceil(kTurnNanoseconds / nanoseconds), 1.0, kMaxRepeats));
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
  int repeats = 1;
  for (int round = 0; round <= rounds; ++round) {
    for (size_t i = 0; i < scenes.size(); ++i) {
      ASSIGN_OR_RETURN(const TurnCosts turned, turn(client, scenes[i], queries, repeats));
      if (round == 0) {
        if (i == 0) repeats = repeats_for(turned);
        continue;
      }
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
