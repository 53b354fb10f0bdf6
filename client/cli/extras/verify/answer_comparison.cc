#include "client/cli/extras/verify/answer_comparison.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/reflection.h>

#include <algorithm>
#include <vector>

namespace locus::cli {
namespace {

using google::protobuf::FieldDescriptor;

// Returns the bytes of the values of a field, and the number of its values.
struct Values {
  std::string bytes;
  size_t count = 0;
};

template <class T>
Values values_of(const v1::BlockResult& block, const FieldDescriptor& field) {
  Values values;
  for (const T value : block.GetReflection()->GetRepeatedFieldRef<T>(block, &field)) {
    values.bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
    ++values.count;
  }
  return values;
}

Values values_of(const v1::BlockResult& block, const FieldDescriptor& field) {
  if (!field.is_repeated()) {
    if (field.cpp_type() != FieldDescriptor::CPPTYPE_STRING) return {};
    std::string bytes = block.GetReflection()->GetString(block, &field);
    const size_t count = bytes.size();
    return {std::move(bytes), count};
  }
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_FLOAT:
      return values_of<float>(block, field);
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return values_of<double>(block, field);
    case FieldDescriptor::CPPTYPE_UINT32:
      return values_of<uint32_t>(block, field);
    case FieldDescriptor::CPPTYPE_UINT64:
      return values_of<uint64_t>(block, field);
    default:
      return {};
  }
}

// Returns the index of the first value that differs; the number of values of the shorter list if it begins the other.
size_t first_differing_value(const Values& a, const Values& b) {
  const size_t bytes = a.count == 0 ? 1 : std::max<size_t>(a.bytes.size() / a.count, 1);
  const auto differ = std::mismatch(a.bytes.begin(), a.bytes.end(), b.bytes.begin(), b.bytes.end());
  return static_cast<size_t>(differ.first - a.bytes.begin()) / bytes;
}

// Returns the query to which row `row` belongs.
size_t query_of_row(const v1::BlockResult& block, size_t row) {
  if (block.counts().empty()) return row;
  size_t end = 0;
  for (int query = 0; query < block.counts_size(); ++query) {
    end += block.counts(query);
    if (row < end) return static_cast<size_t>(query);
  }
  return static_cast<size_t>(block.counts_size());
}

size_t rows_of(const v1::BlockResult& block, size_t queries) {
  if (block.counts().empty()) return queries;
  size_t rows = 0;
  for (const uint32_t count : block.counts()) rows += count;
  return rows;
}

// Returns whether a field has the same number of values for each query, rather than for each row.
bool is_per_query(const std::string& field) {
  return field == "counts" || field == "hits" || field == "sight" || field == "resolved_ticks" ||
         field == "resolved_fractions";
}

AnswerDifference difference_of(const v1::QueryBlock& asked, const v1::BlockResult& a, const v1::BlockResult& b) {
  AnswerDifference found;
  const size_t queries = query_count(asked), rows = rows_of(a, queries);
  const google::protobuf::Descriptor& type = *a.GetDescriptor();
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& field = *type.field(i);
    const Values first = values_of(a, field), second = values_of(b, field);
    if (first.bytes == second.bytes) continue;
    const size_t at = first_differing_value(first, second);
    const bool per_query = is_per_query(field.name());
    const size_t all = per_query ? queries : rows;
    std::optional<size_t> query;
    const bool lists_queries = field.name() == "truncated" || field.name() == "clamped" || field.name() == "unanchored";
    if (!lists_queries && all != 0 && first.count >= all && first.count % all == 0) {
      const size_t row = std::min(at / (first.count / all), all - 1);
      query = per_query ? row : query_of_row(a, row);
    }
    if (!found.column.empty() && (!query || (found.query && *found.query <= *query))) continue;
    found.query = query;
    found.column = field.name();
  }
  return found;
}

}  // namespace

std::string kind_name(const v1::QueryBlock& block) {
  const FieldDescriptor* const field =
      v1::QueryBlock::descriptor()->FindFieldByNumber(static_cast<int>(block.kind_case()));
  return field == nullptr ? "none" : field->name();
}

size_t query_count(const v1::QueryBlock& block) {
  const auto triples = [](const auto& column) { return static_cast<size_t>(column.size()) / 3; };
  switch (block.kind_case()) {
    case v1::QueryBlock::kRays:
      return triples(block.rays().origins());
    case v1::QueryBlock::kBalls:
      return triples(block.balls().centers());
    case v1::QueryBlock::kBoxes:
      return triples(block.boxes().centers());
    case v1::QueryBlock::kCapsules:
      return triples(block.capsules().starts());
    case v1::QueryBlock::kSweeps:
      return triples(block.sweeps().starts());
    case v1::QueryBlock::kNearest:
      return triples(block.nearest().points());
    case v1::QueryBlock::kContains:
      return triples(block.contains().points());
    case v1::QueryBlock::kCells:
      return triples(block.cells().points());
    case v1::QueryBlock::kPairs:
      return 1;
    case v1::QueryBlock::kLookup:
      return static_cast<size_t>(block.lookup().ids_size() + block.lookup().groups_size());
    case v1::QueryBlock::kSight:
      return triples(block.sight().viewers()) / std::max(1u, block.sight().eyes_per_viewer());
    case v1::QueryBlock::kFrustums:
      if (block.frustums().view_projections_size() != 0)
        return static_cast<size_t>(block.frustums().view_projections_size()) / 16;
      return static_cast<size_t>(block.frustums().planes_size()) / 4 / std::max(1u, block.frustums().planes_each());
    case v1::QueryBlock::KIND_NOT_SET:
      break;
  }
  return 0;
}

std::optional<AnswerDifference> first_difference(const v1::QueryBatch& batch, const v1::QueryResult& first,
                                                 const v1::QueryResult& second) {
  const int blocks = std::min({batch.blocks_size(), first.blocks_size(), second.blocks_size()});
  for (int i = 0; i < blocks; ++i) {
    if (first.blocks(i).SerializeAsString() == second.blocks(i).SerializeAsString()) continue;
    AnswerDifference found = difference_of(batch.blocks(i), first.blocks(i), second.blocks(i));
    found.block = static_cast<size_t>(i);
    return found;
  }
  if (first.blocks_size() == second.blocks_size() && first.blocks_size() == batch.blocks_size()) return std::nullopt;
  return AnswerDifference{static_cast<size_t>(blocks), std::nullopt, "blocks"};
}

}  // namespace locus::cli
