#include "core/base/column.h"

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"

namespace locus {

std::string ColumnName::text() const {
  return index ? absl::StrCat(list, "[", *index, "].", column) : absl::StrCat(list, ".", column);
}

absl::Status refuse_column_length(size_t value_count, size_t width, size_t items, ColumnNeed need,
                                  const ColumnName& name) {
  std::string accepted = absl::StrCat(width * items);
  if (need == ColumnNeed::kEachOrOne || need == ColumnNeed::kOptional)
    absl::StrAppend(&accepted, ", ", width, " for all");
  if (need == ColumnNeed::kOptional) absl::StrAppend(&accepted, ", or none");
  return refuse_argument(Reason::kColumnLength, name.text(), {},
                         absl::StrCat("holds ", value_count, " numbers; for ", items, " items give ", accepted));
}

}  // namespace locus
