// Options of queries about past times: the times, and how times outside the recorded history are handled. For the query
// and get commands. Plain data and functions without state.
#ifndef LOCUS_CLIENT_CLI_ROWS_PAST_OPTIONS_H_
#define LOCUS_CLIENT_CLI_ROWS_PAST_OPTIONS_H_

#include <cstdint>
#include <istream>
#include <ostream>
#include <vector>

#include "CLI/CLI.hpp"
#include "client/cli/output.h"
#include "client/lib/query_blocks.h"

namespace locus::cli {

// Time given as "12" or "12+0.5": a tick, and a fraction of the time to the next tick. operator>> sets failbit for any
// other text.
struct AsOf {
  uint64_t tick = 0;
  float fraction = 0;
};
std::istream& operator>>(std::istream& in, AsOf& time);
std::ostream& operator<<(std::ostream& out, const AsOf& time);

struct PastOptions {
  std::vector<AsOf> as_of;
  v1::OutsideHistory outside = v1::OUTSIDE_HISTORY_UNSPECIFIED;
};

// Adds the options --as-of and --outside.
void add_past_options(CLI::App& command, PastOptions& options);

std::vector<uint64_t> ticks_of(const std::vector<AsOf>& times);
// Returns the fraction of each time; empty if all fractions are 0, which is the default of the request.
std::vector<float> fractions_of(const std::vector<AsOf>& times);

template <class Block>
void apply_to_block(const PastOptions& options, Block& block) {
  block.as_of(ticks_of(options.as_of), fractions_of(options.as_of)).outside_history(options.outside);
}

// Returns whether rows have the key as_of: the query is about the past, and the format shows only rows.
bool rows_have_time(const PastOptions& options, Format format);

// Returns the effective time of each query about the past, in the form of --as-of. It differs from the requested time
// if the requested time was clamped to the recorded history.
Json resolved_json(const v1::BlockResult& block);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_PAST_OPTIONS_H_
