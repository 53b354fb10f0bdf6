// Parameters of an SQL statement in PostgreSQL's binary format: big-endian integers of 64 bits, texts, bytes, and
// arrays of integers, texts and bytes. Texts and bytes are borrowed: they must outlive the statement's sending.
// Unsigned numbers are stored as the signed number of the same bits. One thread at a time.
#ifndef LOCUS_SERVER_STORAGE_POSTGRES_SQL_PARAMETERS_H_
#define LOCUS_SERVER_STORAGE_POSTGRES_SQL_PARAMETERS_H_

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "server/storage/rows/row_codec.h"

namespace locus::server {

class SqlParameters {
 public:
  SqlParameters() = default;
  SqlParameters(SqlParameters&&) = default;
  SqlParameters(const SqlParameters&) = delete;  // the pointers of a copy would point into the original
  SqlParameters& operator=(const SqlParameters&) = delete;

  SqlParameters& number(uint64_t value) { return own(RowWriter().big_u64(value).take()); }
  SqlParameters& text(absl::string_view value) { return bytes(value); }
  SqlParameters& bytes(absl::string_view value) {
    // A null pointer would be SQL's NULL.
    values_.push_back(value.data() == nullptr ? "" : value.data());
    lengths_.push_back(static_cast<int>(value.size()));
    formats_.push_back(1);
    return *this;
  }
  SqlParameters& numbers(absl::Span<const uint64_t> values) {
    RowWriter out = array_head(kBigint, values.size());
    for (const uint64_t value : values) out.big_u32(sizeof(value)).big_u64(value);
    return own(out.take());
  }
  // Copy the values, because an array is one parameter.
  SqlParameters& list_of_bytes(absl::Span<const absl::string_view> values) { return list(kBytea, values); }
  SqlParameters& list_of_texts(absl::Span<const absl::string_view> values) { return list(kText, values); }

  int count() const { return static_cast<int>(values_.size()); }
  const char* const* values() const { return values_.data(); }
  const int* lengths() const { return lengths_.data(); }
  const int* formats() const { return formats_.data(); }

 private:
  // Numbers by which PostgreSQL's catalogue names the types of array elements.
  static constexpr uint32_t kBytea = 17;
  static constexpr uint32_t kBigint = 20;
  static constexpr uint32_t kText = 25;

  static RowWriter array_head(uint32_t element_type, size_t size) {
    RowWriter out;
    out.big_u32(size == 0 ? 0 : 1).big_u32(0).big_u32(element_type);    // dimensions, no nulls, type
    if (size > 0) out.big_u32(static_cast<uint32_t>(size)).big_u32(1);  // length and first index of the dimension
    return out;
  }
  SqlParameters& list(uint32_t element_type, absl::Span<const absl::string_view> values) {
    RowWriter out = array_head(element_type, values.size());
    for (const absl::string_view value : values) out.big_u32(static_cast<uint32_t>(value.size())).bytes(value);
    return own(out.take());
  }
  SqlParameters& own(std::string value) {
    owned_.push_back(std::move(value));
    return bytes(owned_.back());
  }

  std::deque<std::string> owned_;  // a deque: later elements must not move earlier ones
  std::vector<const char*> values_;
  std::vector<int> lengths_;
  std::vector<int> formats_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_POSTGRES_SQL_PARAMETERS_H_
