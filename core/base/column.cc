#include "core/base/column.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"

namespace locus {
namespace {

bool fits(size_t numbers, size_t width, size_t items, ColumnNeed need) {
  if (numbers == width * items) return true;
  const bool one = need == ColumnNeed::kEachOrOne || need == ColumnNeed::kOptional;
  return (one && numbers == width) || (need == ColumnNeed::kOptional && numbers == 0);
}

}  // namespace

absl::Status check_column(size_t numbers, size_t width, size_t items, ColumnNeed need, absl::string_view field) {
  if (fits(numbers, width, items, need)) return absl::OkStatus();
  std::string wanted = absl::StrCat(width * items);
  if (need == ColumnNeed::kEachOrOne || need == ColumnNeed::kOptional)
    absl::StrAppend(&wanted, ", ", width, " for all");
  if (need == ColumnNeed::kOptional) absl::StrAppend(&wanted, ", or none");
  return refuse_argument(Reason::kColumnLength, field, {},
                         absl::StrCat("holds ", numbers, " numbers; for ", items, " items give ", wanted));
}

}  // namespace locus
