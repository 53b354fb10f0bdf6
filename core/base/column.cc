#include "core/base/column.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/refusal.h"

namespace locus {
namespace {

bool fits(size_t value_count, size_t width, size_t items, ColumnNeed need) {
  if (value_count == width * items) return true;
  const bool one_allowed = need == ColumnNeed::kEachOrOne || need == ColumnNeed::kOptional;
  return (one_allowed && value_count == width) || (need == ColumnNeed::kOptional && value_count == 0);
}

}  // namespace

absl::Status check_column(size_t value_count, size_t width, size_t items, ColumnNeed need, absl::string_view field) {
  LOCUS_DCHECK_GT(width, 0u);
  if (fits(value_count, width, items, need)) return absl::OkStatus();
  std::string accepted = absl::StrCat(width * items);
  if (need == ColumnNeed::kEachOrOne || need == ColumnNeed::kOptional)
    absl::StrAppend(&accepted, ", ", width, " for all");
  if (need == ColumnNeed::kOptional) absl::StrAppend(&accepted, ", or none");
  return refuse_argument(Reason::kColumnLength, field, {},
                         absl::StrCat("holds ", value_count, " numbers; for ", items, " items give ", accepted));
}

}  // namespace locus
