// Options that every kind of query has, and the frame of its positions. For the query commands.
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

// Adds SCENE and the shared options.
void add_query_options(CLI::App& command, QueryOptions& options);

// Adds --detail, for ball, box and nearest.
void add_detail_option(CLI::App& command, v1::StaticDetail& detail);

// Returns a usage error for options that exclude each other.
absl::Status check(const QueryOptions& options);

// Makes the batch ask for at least the last revision of `scene` acknowledged to this context, if any.
void see_own(const std::string& scene, const Context& context, client::QueryBuilder& builder);

// Sets the batch's view, work budget and explain flag. Without --at-least and --exactly, the view is that of see_own().
void apply_to_batch(const QueryOptions& options, const Context& context, client::QueryBuilder& builder);

// Sets the shared options of a block: all except its kind and columns.
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

// Positions of a query as floats relative to a frame. The frame is the origin if every coordinate is exactly a float,
// else the first position, so that coordinates that are large or not exact in float keep their precision.
struct FramedPositions {
  client::Double3 frame;
  std::vector<float> offsets;
};
FramedPositions framed(const std::vector<Triple>& positions);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_QUERY_OPTIONS_H_
