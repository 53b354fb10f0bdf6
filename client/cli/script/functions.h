// The functions that expressions know. Functions without state.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_FUNCTIONS_H_
#define LOCUS_CLIENT_CLI_SCRIPT_FUNCTIONS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/script/value.h"

namespace locus::cli {

// `length(vector)`, `min(1, 2)` and so on. NOT_FOUND listing the functions there are; INVALID_ARGUMENT for a wrong
// number or kind of arguments; OUT_OF_RANGE where there is no finite result. Unknown arguments give an unknown value.
absl::StatusOr<Value> call_function(const std::string& name, const std::vector<Value>& arguments);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_FUNCTIONS_H_
