// What the work on one message sees of the call it belongs to. The work begins on the call's IO loop and says there,
// once, that it is over; in between it may be anywhere.
#ifndef LOCUS_SERVER_RPC_CALL_SLOT_H_
#define LOCUS_SERVER_RPC_CALL_SLOT_H_

#include <cstdint>

#include "absl/status/status.h"
#include "server/host/host.h"
#include "server/rpc/call.h"
#include "server/rpc/io_threads.h"

namespace locus::server {

class CallSlot {
 public:
  explicit CallSlot(Host& host) : host_(host) {}
  CallSlot(const CallSlot&) = delete;
  CallSlot& operator=(const CallSlot&) = delete;

  Host& host() const { return host_; }

  // While a message is in work.
  virtual const Caller& caller() const = 0;
  virtual IoLoop& io() const = 0;
  // The same for all calls of a connection, and, as far as can be told, of no other.
  virtual uint64_t client() const = 0;
  // Whether the call goes on after this message.
  virtual bool stream() const = 0;

  // On the IO loop: the call reads no further message until this one is answered.
  virtual void hold() = 0;

  // On the IO loop only, once a message. OK: the response is filled in. The slot may serve another message before
  // this returns.
  virtual void answered(absl::Status status) = 0;

 protected:
  ~CallSlot() = default;

 private:
  Host& host_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_CALL_SLOT_H_
