// Gate before the calls of a client to a server in the same process. Internal to the library. A call that is created on
// an in-process channel of gRPC 1.51 while the server shuts down, or afterwards, ends the process. Therefore calls hold
// a permit of the gate while they are created, and the server closes the gate before it shuts down.
//
// Threads: any thread may call any function.
#ifndef LOCUS_CLIENT_LIB_CALL_GATE_H_
#define LOCUS_CLIENT_LIB_CALL_GATE_H_

#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace locus::client {

class CallGate {
 public:
  // Right to create calls; ends with the object. It may be empty, for connections that need no gate.
  using Permit = std::shared_ptr<const void>;

  // Returns a permit; after close(), UNAVAILABLE. `gate`, which may be null, stays alive as long as the permit.
  static absl::StatusOr<Permit> enter(const std::shared_ptr<CallGate>& gate) {
    if (gate == nullptr) return nullptr;
    const std::lock_guard lock(gate->mutex_);
    if (gate->closed_) return absl::UnavailableError("the server of this process has ended");
    ++gate->permits_;
    return Permit(gate.get(), [gate](const void*) { gate->leave(); });
  }

  // Makes enter() fail from now on.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  // Waits until all permits have ended. Call it after close().
  void wait_until_empty() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return permits_ == 0; });
  }

 private:
  void leave() {
    const std::lock_guard lock(mutex_);
    if (--permits_ == 0) changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  size_t permits_ = 0;
  bool closed_ = false;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_CALL_GATE_H_
