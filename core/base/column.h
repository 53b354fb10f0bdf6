// Reader and length check of packed columns. A column is an array of entries of equal width, such as scalars or points.
// A column of a batch has one entry for each item (each query or update), one entry that applies to all items, or no
// entry. Const access; any thread.
#ifndef LOCUS_CORE_BASE_COLUMN_H_
#define LOCUS_CORE_BASE_COLUMN_H_

#include <cstddef>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/base/check.h"

namespace locus {

// View of a column whose length check_column() has accepted; borrows the values. An entry consists of `width` values.
template <class T>
class ColumnReader {
 public:
  ColumnReader(absl::Span<const T> values, size_t width) : values_(values), width_(width) {
    LOCUS_DCHECK_GT(width_, 0u);
    LOCUS_DCHECK_EQ(values_.size() % width_, 0u);
  }

  bool given() const { return !values_.empty(); }
  // Returns a pointer to the first value of the entry that applies to item `i`. Precondition: given().
  const T* entry(size_t i) const {
    LOCUS_DCHECK(given());
    LOCUS_DCHECK(values_.size() == width_ || i < values_.size() / width_);
    return values_.data() + (values_.size() == width_ ? 0 : i * width_);
  }
  T value(size_t i, T fallback) const { return given() ? *entry(i) : fallback; }

 private:
  absl::Span<const T> values_;
  size_t width_;
};

// Accepted numbers of entries of a column. kEach: one entry per item. kEachOrOne: one entry per item, or one entry for
// all items. kOptional: like kEachOrOne, or no entry.
enum class ColumnNeed { kEach, kEachOrOne, kOptional };

// Name of a column in an error: "list[index].column", or "list.column" without an index. Borrows the strings `list` and
// `column`. The text is built only if there is an error, because nearly all columns are valid.
struct ColumnName {
  absl::string_view list;
  std::optional<size_t> index;
  absl::string_view column;

  std::string text() const;
};

// Returns INVALID_ARGUMENT with the reason COLUMN_LENGTH, naming the column, its length and the accepted lengths.
// Arguments as for check_column().
absl::Status refuse_column_length(size_t value_count, size_t width, size_t items, ColumnNeed need,
                                  const ColumnName& name);

// Checks the length of a column that has `value_count` values, `width` values per entry, for a batch of `items` items.
// Returns OK if the column has `items` entries, one entry (kEachOrOne, kOptional) or no entry (kOptional), and the
// error of refuse_column_length() otherwise.
inline absl::Status check_column(size_t value_count, size_t width, size_t items, ColumnNeed need,
                                 const ColumnName& name) {
  LOCUS_DCHECK_GT(width, 0u);
  const bool one_allowed = need == ColumnNeed::kEachOrOne || need == ColumnNeed::kOptional;
  if (value_count == width * items || (one_allowed && value_count == width) ||
      (need == ColumnNeed::kOptional && value_count == 0))
    return absl::OkStatus();
  return refuse_column_length(value_count, width, items, need, name);
}

}  // namespace locus

#endif  // LOCUS_CORE_BASE_COLUMN_H_
