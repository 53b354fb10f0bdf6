// Calls of any unary method by its name, with requests and replies in JSON. The JSON is that of protobuf: 64-bit
// integers are strings, bytes are base64. For tools; functions without state.
#ifndef LOCUS_CLIENT_LIB_JSON_CALLS_H_
#define LOCUS_CLIENT_LIB_JSON_CALLS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/lib/client.h"

namespace locus::client {

// Method of the server's services.
struct MethodInfo {
  std::string service;  // "locus.v1.SceneService"
  std::string name;     // "GetScene"
  std::string request;  // type of the request: "GetSceneRequest"
  std::string reply;    // type of the reply
  bool unary = false;   // one request and one reply; only such methods can be called

  std::string full_name() const { return service + "/" + name; }
};

// Returns all methods of locus.v1 and of the health service, in the order of the protocol's files.
std::vector<MethodInfo> all_methods();

// Calls a unary method and returns its reply as JSON on one line. Not retried. Returns INVALID_ARGUMENT if `json` is no
// request of this method, DATA_LOSS if the reply cannot be read, and the errors of the call.
absl::StatusOr<std::string> call_json(const Client& client, const MethodInfo& method, absl::string_view json);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_JSON_CALLS_H_
