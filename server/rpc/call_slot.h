// Interface between a message's call and the work on the message. The work begins on the call's IO loop and must call
// answered() on that loop exactly once; between these two events the work may run on any thread.
#ifndef LOCUS_SERVER_RPC_CALL_SLOT_H_
#define LOCUS_SERVER_RPC_CALL_SLOT_H_

#include <cstdint>

#include "absl/status/status.h"
#include "server/rpc/call.h"
#include "server/rpc/io_threads.h"

namespace locus::server {

// One message of a call, from its arrival to its answer. The only implementation is HotCall::Slot; this interface keeps
// the work on a message independent of the templates of hot_call.h.
class CallSlot {
 public:
  CallSlot() = default;
  CallSlot(const CallSlot&) = delete;
  CallSlot& operator=(const CallSlot&) = delete;

  // Returns the caller. Valid while a message is being processed.
  virtual const Caller& caller() const = 0;
  virtual IoLoop& io() const = 0;
  // Returns Caller::client(), the id by which the scheduler gives each client a fair share.
  virtual uint64_t client() const = 0;
  // Returns whether the call is a stream.
  virtual bool stream() const = 0;

  // Claims memory for an answer of at most `bytes` encoded bytes, until the answer is written. Call it on the IO loop,
  // before the answer is built. Returns RESOURCE_EXHAUSTED if there is not enough memory.
  virtual absl::Status claim_answer(uint64_t bytes) = 0;

  // Gives away the claim for the memory of the request, which the caller of this function keeps beyond the answer.
  virtual CallMemory take_request_claim() = 0;

  // Stops the call from reading further messages until this message is answered. Call it on the IO loop.
  virtual void hold() = 0;

  // Ends the work on the message. Call it on the IO loop only, exactly once for each message. If `status` is OK, the
  // response must be filled in before. When answered() returns, the slot may already serve another message.
  virtual void answered(absl::Status status) = 0;

 protected:
  ~CallSlot() = default;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_CALL_SLOT_H_
