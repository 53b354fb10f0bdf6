// Reader and length check of packed columns. A column is an array of entries of equal width, such as scalars or points.
// It has one entry per item, one entry that applies to all items, or none. Const access; any thread.
#ifndef LOCUS_CORE_BASE_COLUMN_H_
#define LOCUS_CORE_BASE_COLUMN_H_

#include <cstddef>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/base/check.h"

namespace locus {

// View of a column whose length check_column() has accepted; does not own the values. An entry consists of `width`
// values.
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

// Accepted numbers of entries of a column. kEach: one per item. kEachOrOne: one per item, or one for all items.
// kOptional: one per item, one for all items, or none.
enum class ColumnNeed { kEach, kEachOrOne, kOptional };

// Checks the length of a column that has `value_count` values, `width` per entry. Returns OK if it holds `items`
// entries, one entry (kEachOrOne, kOptional) or none (kOptional). Otherwise returns INVALID_ARGUMENT with the reason
// COLUMN_LENGTH, naming `field`, the count and the accepted counts.
absl::Status check_column(size_t value_count, size_t width, size_t items, ColumnNeed need, absl::string_view field);

}  // namespace locus

#endif  // LOCUS_CORE_BASE_COLUMN_H_
