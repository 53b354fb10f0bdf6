#include "client/cli/levels/import/import_error.h"

#include "absl/strings/str_cat.h"

namespace locus::cli {

absl::Status exceeds(absl::string_view what, absl::string_view has, absl::string_view name, uint64_t value,
                     absl::string_view remedy) {
  return absl::ResourceExhaustedError(
      absl::StrCat(what, " has ", has, ", the limit ", name, " is ", value, ": ", remedy));
}

}  // namespace locus::cli
