// Reading packed columns: one value or one point after the other, one entry for each item, one for all, or none.
#ifndef LOCUS_CORE_BASE_COLUMN_H_
#define LOCUS_CORE_BASE_COLUMN_H_

#include <cstddef>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"

namespace locus {

// A borrowed column whose length check_column() has accepted. `width` numbers make one entry.
template <class T>
class ColumnReader {
 public:
  ColumnReader(absl::Span<const T> values, size_t width) : values_(values), width_(width) {}

  bool given() const { return !values_.empty(); }
  // First number of item i's entry. Only for a given column.
  const T* entry(size_t i) const { return values_.data() + (values_.size() == width_ ? 0 : i * width_); }
  T value(size_t i, T fallback) const { return given() ? *entry(i) : fallback; }

 private:
  absl::Span<const T> values_;
  size_t width_;
};

enum class ColumnNeed { kEach, kEachOrOne, kOptional };

// INVALID_ARGUMENT COLUMN_LENGTH naming `field`, what it holds and what it may hold, unless `numbers` numbers are as
// many as `items` entries of `width` (kEach), or one entry as well (kEachOrOne), or none as well (kOptional).
absl::Status check_column(size_t numbers, size_t width, size_t items, ColumnNeed need, absl::string_view field);

}  // namespace locus

#endif  // LOCUS_CORE_BASE_COLUMN_H_
