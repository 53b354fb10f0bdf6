// Comparison of two answers to the same batch, byte for byte, and the kinds and numbers of a batch's queries. For
// `locus verify` and `locus tune`. Functions without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_VERIFY_ANSWER_COMPARISON_H_
#define LOCUS_CLIENT_CLI_EXTRAS_VERIFY_ANSWER_COMPARISON_H_

#include <cstddef>
#include <optional>
#include <string>

#include "client/lib/client.h"

namespace locus::cli {

// Returns the name of a block's kind, such as "balls"; "none" if it has none.
std::string kind_name(const v1::QueryBlock& block);

// Returns the number of queries of a block.
size_t query_count(const v1::QueryBlock& block);

struct AnswerDifference {
  size_t block = 0;             // index in the batch
  std::optional<size_t> query;  // index in the block; none if the answers differ in something other than one query
  std::string column;           // field of BlockResult that differs first, such as "ids"
};

// Returns the first difference of the answers to `batch`: the first block whose bytes differ, and its first query whose
// rows differ. Returns nullopt if the bytes of all blocks are equal.
std::optional<AnswerDifference> first_difference(const v1::QueryBatch& batch, const v1::QueryResult& first,
                                                 const v1::QueryResult& second);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_VERIFY_ANSWER_COMPARISON_H_
