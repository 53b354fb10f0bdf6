// Turns of queries at several scenes, for `locus tune`: in every round, each scene is asked all queries, and the
// medians over the rounds are their costs. The costs are those that the server measured (`explain`: processor time), so
// they do not include the transport.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TUNE_QUERY_TURNS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TUNE_QUERY_TURNS_H_

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/extras/tune/cell_choice.h"
#include "client/cli/extras/tune/query_set.h"
#include "client/lib/client.h"

namespace locus::cli {

// Cost of a query by kind.
using KindCosts = std::map<std::string, KindCost>;

// Returns the costs of the queries at each scene, in the order of `scenes`. A first round is not counted; it determines
// how many of the batches are asked in a turn, and how often, so that a turn is long enough to measure and none takes
// long. `on_round` is called after each round with their number. The error of a refused batch names its place.
absl::StatusOr<std::vector<KindCosts>> ask_in_turns(const client::Client& client,
                                                    const std::vector<std::string>& scenes, const QuerySet& queries,
                                                    int rounds, const std::function<void(int done)>& on_round);

// Returns the middle value, or the mean of the two middle ones. Precondition: there is a value.
double median(std::vector<double> values);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TUNE_QUERY_TURNS_H_
