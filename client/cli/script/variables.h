// The variables of a running script, by name. For expressions and statements. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_VARIABLES_H_
#define LOCUS_CLIENT_CLI_SCRIPT_VARIABLES_H_

#include <map>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "client/cli/script/value.h"

namespace locus::cli {

// A letter or an underscore, then letters, digits and underscores.
bool is_name(absl::string_view text);
bool begins_name(char c);
bool continues_name(char c);

class Variables {
 public:
  // INVALID_ARGUMENT for what is no name, RESOURCE_EXHAUSTED for one more than kMaxVariables.
  absl::Status set(const std::string& name, Value value);
  // Null if there is none.
  const Value* find(const std::string& name) const;

 private:
  std::map<std::string, Value> values_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_VARIABLES_H_
