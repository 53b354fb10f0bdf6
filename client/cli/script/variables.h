// Variables of a running script, by name. For expressions and statements. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_VARIABLES_H_
#define LOCUS_CLIENT_CLI_SCRIPT_VARIABLES_H_

#include <map>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "client/cli/script/value.h"

namespace locus::cli {

// Returns whether `text` is a letter or an underscore, followed by letters, digits and underscores.
bool is_name(absl::string_view text);
bool begins_name(char c);
bool continues_name(char c);

class Variables {
 public:
  // Sets a variable. Returns INVALID_ARGUMENT for an invalid name, RESOURCE_EXHAUSTED beyond kMaxVariables.
  absl::Status set(const std::string& name, Value value);
  // Returns the value, or null if the variable does not exist.
  const Value* find(const std::string& name) const;

 private:
  std::map<std::string, Value> values_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_VARIABLES_H_
