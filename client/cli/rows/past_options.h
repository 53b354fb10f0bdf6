// Options of questions about the past: when to ask, and what to do about times that are not kept. For the query and get
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

// "12" or "12+0.5": a tick, and how far from there to the next. Reading sets failbit on anything else.
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

// --as-of and --outside.
void add_past_options(CLI::App& command, PastOptions& options);

std::vector<uint64_t> ticks_of(const std::vector<AsOf>& times);
// None where all are 0.
std::vector<float> fractions_of(const std::vector<AsOf>& times);

template <class Block>
void apply_to_block(const PastOptions& options, Block& block) {
  block.as_of(ticks_of(options.as_of), fractions_of(options.as_of)).outside_history(options.outside);
}

// The times that were asked in fact, as --as-of takes them, by query.
Json resolved_json(const v1::BlockResult& block);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_PAST_OPTIONS_H_
