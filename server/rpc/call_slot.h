// Interface between a message's call and the work on the message. The work begins on the call's IO loop and must call
// answered() there exactly once; in between it may run on any thread.
#ifndef LOCUS_SERVER_RPC_CALL_SLOT_H_
#define LOCUS_SERVER_RPC_CALL_SLOT_H_

#include <cstdint>

#include "absl/status/status.h"
#include "server/host/host.h"
#include "server/rpc/call.h"
#include "server/rpc/io_threads.h"

namespace locus::server {

// A message's place in its call. Its only implementation is HotCall::Slot; this interface keeps the work on a message
// independent of the templates of hot_call.h.
class CallSlot {
 public:
  explicit CallSlot(Host& host) : host_(host) {}
  CallSlot(const CallSlot&) = delete;
  CallSlot& operator=(const CallSlot&) = delete;

  Host& host() const { return host_; }

  // Returns the caller. Valid while a message is being processed.
  virtual const Caller& caller() const = 0;
  virtual IoLoop& io() const = 0;
  // Returns an id of the client, which the scheduler uses for fair shares: equal for all calls of one connection, and
  // different for other connections as far as gRPC can distinguish them.
  virtual uint64_t client() const = 0;
  // Returns whether the call is a stream.
  virtual bool stream() const = 0;

  // Stops the call from reading further messages until this message is answered. Call it on the IO loop.
  virtual void hold() = 0;

  // Ends the work on the message. Call it on the IO loop only, exactly once for each message. If `status` is OK, the
  // response must be filled in. The slot may already serve another message when this returns.
  virtual void answered(absl::Status status) = 0;

 protected:
  ~CallSlot() = default;

 private:
  Host& host_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_CALL_SLOT_H_
