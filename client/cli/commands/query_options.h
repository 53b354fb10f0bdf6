// Options that every kind of query has, and the choice of a frame for a query's positions. For the query commands.
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
  std::vector<Number64> only_groups;
  std::vector<Number64> tags;
  std::vector<Number64> tag_masks;
  std::vector<Number64> self_ids;
  std::vector<Number64> anchors;
  bool count_only = false;
  uint32_t max_results = 0;
  Number64 after_id;
  PastOptions past;
  std::optional<uint64_t> at_least;
  std::optional<uint64_t> exactly;
  Number64 epoch;
  uint64_t max_work = 0;
  bool explain = false;
  bool by_list = false;
};

// Adds the argument SCENE and the options shared by all queries.
void add_query_options(CLI::App& command, QueryOptions& options);

// Adds the option --detail. Overlap queries, frustum queries and nearest queries have this option.
void add_detail_option(CLI::App& command, v1::StaticDetail& detail);

// Adds the option --after-id, for queries whose rows are in ascending order of ids.
void add_after_id_option(CLI::App& command, QueryOptions& options);

// Returns the columns to request and show: `first`, followed by the columns of --columns, or by `otherwise` if
// --columns is not given.
std::vector<v1::Column> columns_behind(std::vector<v1::Column> first, const QueryOptions& options,
                                       const std::vector<v1::Column>& otherwise = {});

// Returns the columns of an overlap query: the ids, then the triangles if `detail` requests a row per triangle, then
// the columns of --columns.
std::vector<v1::Column> overlap_columns(const QueryOptions& options, v1::StaticDetail detail);

// Returns a usage error if options exclude each other.
absl::Status check(const QueryOptions& options);

// Makes the batch see the changes that this context has made to `scene`. For this, the batch requires at least the
// revision of the last acknowledged change. Does nothing if no change was acknowledged.
void see_own(const std::string& scene, const Context& context, client::QueryBuilder& builder);

// Sets the batch's revision, work budget and flags from the options. Without --at-least and --exactly, calls
// see_own().
void apply_to_batch(const QueryOptions& options, const Context& context, client::QueryBuilder& builder);

// Restricts all queries of a block to the groups of --only-group, if there are any.
template <class Block>
void apply_only_groups(const QueryOptions& options, Block& block) {
  if (!options.only_groups.empty())
    block.only_groups(values_of(options.only_groups), static_cast<uint32_t>(options.only_groups.size()));
}

// Sets those options of a block that all kinds of query share. The caller must set the block's kind and columns.
template <class Block>
void apply_to_block(const QueryOptions& options, Block& block) {
  block.source(options.source)
      .precision(options.precision)
      .masks(values32_of(options.masks))
      .ignore_groups(values_of(options.ignore_groups))
      .ignore_ids(values_of(options.ignore_ids))
      .max_results(options.max_results)
      .after_id(options.after_id.value)
      .anchors(values_of(options.anchors))
      .tags(values_of(options.tags), values_of(options.tag_masks))
      .self_ids(values_of(options.self_ids));
  apply_only_groups(options, block);
  if (options.count_only) block.count_only();
  apply_to_block(options.past, block);
}

// Positions of a query as float offsets from a frame. The frame is the origin if every coordinate is exactly
// representable as a float. Otherwise it is the first position, so that positions far from the origin do not lose
// precision.
struct FramedPositions {
  client::Double3 frame;
  std::vector<float> offsets;
};
FramedPositions framed(const std::vector<Triple>& positions);

// Starts and ends of movements or segments as float offsets from one frame, which is chosen as in FramedPositions.
struct FramedPaths {
  client::Double3 frame;
  std::vector<float> starts;
  std::vector<float> ends;
};
FramedPaths framed(const std::vector<Triple>& starts, const std::vector<Triple>& ends);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_COMMANDS_QUERY_OPTIONS_H_
