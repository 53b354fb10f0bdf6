// Options of queries about the past: the time, and the treatment of times outside the history. For the query and get
// commands. Plain data and functions without state.
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

// Time given as "12" or "12+0.5": a tick and a fraction of the way to the next. Reading sets failbit on other texts.
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

// Adds --as-of and --outside.
void add_past_options(CLI::App& command, PastOptions& options);

std::vector<uint64_t> ticks_of(const std::vector<AsOf>& times);
// Returns the fractions of the times; empty if all are 0.
std::vector<float> fractions_of(const std::vector<AsOf>& times);

template <class Block>
void apply_to_block(const PastOptions& options, Block& block) {
  block.as_of(ticks_of(options.as_of), fractions_of(options.as_of)).outside_history(options.outside);
}

// Returns the effective time of each query, in the form of --as-of.
Json resolved_json(const v1::BlockResult& block);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_PAST_OPTIONS_H_
