// Built-in functions of expressions. Functions without state.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_FUNCTIONS_H_
#define LOCUS_CLIENT_CLI_SCRIPT_FUNCTIONS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/script/value.h"

namespace locus::cli {

// Calls a built-in function, such as `length(vector)` or `min(1, 2)`. Returns NOT_FOUND with the names of all functions
// if no function is called `name`, INVALID_ARGUMENT for a wrong number or kind of arguments, OUT_OF_RANGE if the result
// is not finite. The result is unknown if an argument is unknown.
absl::StatusOr<Value> call_function(const std::string& name, const std::vector<Value>& arguments);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_FUNCTIONS_H_
