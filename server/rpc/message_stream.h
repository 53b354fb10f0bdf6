// Interface with which the body of a blocking call reads the caller's messages and writes its responses. Threads: the
// call's thread only.
#ifndef LOCUS_SERVER_RPC_MESSAGE_STREAM_H_
#define LOCUS_SERVER_RPC_MESSAGE_STREAM_H_

#include <google/protobuf/message.h>

#include "absl/status/statusor.h"
#include "server/rpc/wire_plan.h"

namespace locus::server {

class MessageStream {
 public:
  virtual ~MessageStream() = default;

  // Reads the caller's next message into `request`. Returns false if no more messages come or the call has ended.
  // Blocks, but at most for RpcState::stall_limit, after which the call is cancelled. Returns INVALID_ARGUMENT if the
  // bytes are not a message of this type or if the message exceeds a limit, and RESOURCE_EXHAUSTED if there is not
  // enough memory for the message. Claims the message's memory until the next call of read() or the end of the call.
  template <class Request>
  absl::StatusOr<bool> read(Request& request) {
    return read_planned(wire_plan<Request>(), request);
  }

  // Writes a message to the caller. Returns false if the call has ended. Blocks until the network takes the message,
  // but at most for RpcState::stall_limit, after which the call is cancelled.
  virtual bool write(const google::protobuf::Message& response) = 0;
  // Sets the only response of the call, which is sent with the status after the body has returned OK. Does not block.
  virtual void answer(const google::protobuf::Message& response) = 0;

 protected:
  virtual absl::StatusOr<bool> read_planned(const WirePlan& plan, google::protobuf::Message& request) = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_MESSAGE_STREAM_H_
