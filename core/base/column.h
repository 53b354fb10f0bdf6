// Readers and length checks of packed columns: scalars or points stored one after the other, with one entry per item,
// one entry for all items, or none. Const access; any thread.
#ifndef LOCUS_CORE_BASE_COLUMN_H_
#define LOCUS_CORE_BASE_COLUMN_H_

#include <cstddef>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/base/check.h"

namespace locus {

// Borrowed column whose length check_column() has accepted. An entry consists of `width` values.
template <class T>
class ColumnReader {
 public:
  ColumnReader(absl::Span<const T> values, size_t width) : values_(values), width_(width) {
    LOCUS_DCHECK_GT(width_, 0u);
    LOCUS_DCHECK_EQ(values_.size() % width_, 0u);
  }

  bool given() const { return !values_.empty(); }
  // Returns the first value of item i's entry. Precondition: given().
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

// Numbers of entries that a column may have: one per item; or one for all items as well; or none as well.
enum class ColumnNeed { kEach, kEachOrOne, kOptional };

// Returns OK if a column of `value_count` values holds `items` entries of `width` values (kEach), or one entry
// (kEachOrOne, kOptional), or none (kOptional). Otherwise INVALID_ARGUMENT COLUMN_LENGTH, naming `field`, the count and
// the accepted counts.
absl::Status check_column(size_t value_count, size_t width, size_t items, ColumnNeed need, absl::string_view field);

}  // namespace locus

#endif  // LOCUS_CORE_BASE_COLUMN_H_
