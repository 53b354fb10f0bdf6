// Description of a method whose calls block a thread: every method except queries and updates. Services build these
// descriptions; server/rpc/blocking_calls.h serves the methods. Plain data; any thread.
#ifndef LOCUS_SERVER_RPC_BLOCKING_METHOD_H_
#define LOCUS_SERVER_RPC_BLOCKING_METHOD_H_

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/rpc/call.h"
#include "server/rpc/message_stream.h"

namespace locus::server {

// Treatment of a call that arrives while check_serving() fails.
enum class WhileClosed : uint8_t { kRefuse, kServe };

struct BlockingMethod {
  std::string path;        // such as "/locus.v1.SceneService/GetScene"
  std::optional<Rpc> rpc;  // name in the metrics; no value: calls are not counted
  std::function<absl::Status(const Caller&, MessageStream&)> body;
  // Maximum memory in bytes that a call holds for its responses at any time, unless its body claims more.
  uint64_t reply_bytes = 64u << 10;
  bool is_change = false;  // write every call to the audit log, not only refused calls
  WhileClosed while_closed = WhileClosed::kRefuse;
  AdmissionLimiter* limiter = nullptr;  // null: RpcState::calls
  const char* limit = "calls";          // name of the limiter in refusals
};

// Reads the only message of a call.
template <class Request>
absl::Status read_only_message(MessageStream& stream, Request& request) {
  ASSIGN_OR_RETURN(const bool got, stream.read(request));
  if (got) return absl::OkStatus();
  return refuse_argument(Reason::kMalformed, "", {}, "a call of this method has one message; none was sent");
}

// Returns the body of a method with one request and one response. `serve` has the signature absl::Status(const Caller&,
// const Request&, Response&).
template <class Request, class Response, class Serve>
std::function<absl::Status(const Caller&, MessageStream&)> unary_body(Serve serve) {
  return [serve = std::move(serve)](const Caller& caller, MessageStream& stream) -> absl::Status {
    Request request;
    RETURN_IF_ERROR(read_only_message(stream, request));
    Response response;
    RETURN_IF_ERROR(serve(caller, request, response));
    stream.answer(response);
    return absl::OkStatus();
  };
}

// Returns the body of a method with one request and a stream of responses. `serve` has the signature absl::Status(const
// Caller&, const Request&, MessageStream&).
template <class Request, class Serve>
std::function<absl::Status(const Caller&, MessageStream&)> streaming_body(Serve serve) {
  return [serve = std::move(serve)](const Caller& caller, MessageStream& stream) -> absl::Status {
    Request request;
    RETURN_IF_ERROR(read_only_message(stream, request));
    return serve(caller, request, stream);
  };
}

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_BLOCKING_METHOD_H_
