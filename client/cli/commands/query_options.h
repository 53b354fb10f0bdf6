// The options that every kind of query has, and where its positions go. For the query commands.
#ifndef LOCUS_CLIENT_CLI_COMMANDS_QUERY_OPTIONS_H_
#define LOCUS_CLIENT_CLI_COMMANDS_QUERY_OPTIONS_H_

#include <optional>
#include <string>
#include <vector>

#include "CLI/CLI.hpp"
#include "absl/status/status.h"
#include "client/cli/arguments.h"
#include "client/cli/context.h"
#include "client/cli/rows/past_options.h"
#include "client/lib/query_builder.h"

namespace locus::cli {

struct QueryOptions {
  std::string scene;
  v1::Source source = v1::SOURCE_UNSPECIFIED;
  v1::Precision precision = v1::PRECISION_UNSPECIFIED;
  std::vector<v1::Column> columns;
  std::vector<Number64> masks;
  std::vector<Number64> ignore_groups;
  std::vector<Number64> ignore_ids;
  uint32_t max_results = 0;
  Number64 after_id;
  PastOptions past;
  std::optional<uint64_t> at_least;
  std::optional<uint64_t> exactly;
  Number64 epoch;
  uint64_t max_work = 0;
  bool explain = false;
};

// SCENE and the shared options. `columns` are the names `--columns` knows besides the shared ones.
void add_query_options(CLI::App& command, QueryOptions& options);

// --detail of ball, box and nearest.
void add_detail_option(CLI::App& command, v1::StaticDetail& detail);

// Usage error for options that exclude each other.
absl::Status check(const QueryOptions& options);

// Makes the batch see what was acknowledged to this context on the scene, if anything was.
void see_own(const std::string& scene, const Context& context, client::QueryBuilder& builder);

// View and budget. Without a view of its own the batch sees what was acknowledged to this context.
void apply_to_batch(const QueryOptions& options, const Context& context, client::QueryBuilder& builder);

// Everything of a block but its kind and columns.
template <class Block>
void apply_to_block(const QueryOptions& options, Block& block) {
  block.source(options.source)
      .precision(options.precision)
      .masks(values32_of(options.masks))
      .ignore_groups(values_of(options.ignore_groups))
      .ignore_ids(values_of(options.ignore_ids))
      .max_results(options.max_results)
      .after_id(options.after_id.value);
  apply_to_block(options.past, block);
}

// Positions as a query sends them: floats relative to a frame. The frame is the origin where every coordinate is a
// float, else the first position, so that positions far out or in decimals lose nothing that matters.
struct FramedPositions {
  client::Double3 frame;
  std::vector<float> offsets;
};
FramedPositions framed(const std::vector<Triple>& positions);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_QUERY_OPTIONS_H_
