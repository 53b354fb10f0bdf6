// Named contexts, which are the connection options of servers. They are stored in a file of the user; `locus context`
// writes this file. For endpoint_from_environment() and the command line.
//   default = prod
//   [prod]
//   address = game.example.com:7575
//   ca = /etc/game/ca.pem
//   token_file = /etc/game/token
//   scene = arena
// Lines that begin with # are ignored, and are lost when the file is written. The file never contains a token. Plain
// data and functions without state.
#ifndef LOCUS_CLIENT_LIB_SAVED_CONTEXTS_H_
#define LOCUS_CLIENT_LIB_SAVED_CONTEXTS_H_

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace locus::client {

// Connection options of one server. Empty = not set.
struct SavedContext {
  std::string address = {};
  std::string tls = {};  // "true", "false" or empty
  std::string ca = {};
  std::string cert = {};
  std::string key = {};
  std::string server_name = {};
  std::string token_file = {};
  std::string scene = {};  // scene of command lines that name none
};

struct SavedContexts {
  std::string default_name;  // empty = none
  std::map<std::string, SavedContext> by_name;
};

// Returns the name and the value of each option of a context, in the order of the file.
std::vector<std::pair<std::string, std::string>> fields_of(const SavedContext& context);

// Returns the path of the user's file: locus/contexts in $XDG_CONFIG_HOME or in $HOME/.config. Empty if neither
// variable is an absolute path.
std::string default_contexts_path();

// Parses the text of a contexts file. Returns INVALID_ARGUMENT, with `file` and the line number in the message, if a
// line is malformed.
absl::StatusOr<SavedContexts> parse_contexts(absl::string_view file, absl::string_view text);
// Returns the text of a contexts file.
std::string contexts_text(const SavedContexts& contexts);

// Reads the contexts. A missing file counts as a file without contexts. Returns the errors of parse_contexts(),
// INVALID_ARGUMENT for a file that is too large, and FAILED_PRECONDITION for a file that cannot be read.
absl::StatusOr<SavedContexts> read_contexts(const std::string& path);

// Returns the context `name`. If no context has this name, returns NOT_FOUND with the names of the existing contexts.
absl::StatusOr<SavedContext> find_context(const SavedContexts& contexts, const std::string& name);

// Returns OK if the name has 1 to 63 characters of a-z, A-Z, 0-9, `-`, `_` and `.`; otherwise INVALID_ARGUMENT.
absl::Status check_context_name(absl::string_view name);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_SAVED_CONTEXTS_H_
