// Set of the calls of one client that are in progress, so that another thread can cancel them. Internal to the library.
// Thread-safe.
#ifndef LOCUS_CLIENT_LIB_RUNNING_CALLS_H_
#define LOCUS_CLIENT_LIB_RUNNING_CALLS_H_

#include <cstdint>
#include <mutex>
#include <set>

#include "grpcpp/client_context.h"

namespace locus::client {

class RunningCalls {
 public:
  void add(grpc::ClientContext& context) {
    const std::lock_guard lock(mutex_);
    contexts_.insert(&context);
  }
  void remove(grpc::ClientContext& context) {
    const std::lock_guard lock(mutex_);
    contexts_.erase(&context);
  }
  // Cancels every call; each returns CANCELLED.
  void cancel_all() {
    const std::lock_guard lock(mutex_);
    ++cancelled_;
    for (grpc::ClientContext* const context : contexts_) context->TryCancel();
  }
  // Returns how often cancel_all() was called.
  uint64_t cancelled() const {
    const std::lock_guard lock(mutex_);
    return cancelled_;
  }

 private:
  mutable std::mutex mutex_;
  uint64_t cancelled_ = 0;
  std::set<grpc::ClientContext*> contexts_;
};

// Context of one call that RunningCalls::cancel_all() can cancel.
class CancellableContext final : public grpc::ClientContext {
 public:
  // `calls` may be null: then the context belongs to no set.
  explicit CancellableContext(RunningCalls* calls) : calls_(calls) {
    if (calls_ != nullptr) calls_->add(*this);
  }
  ~CancellableContext() {
    if (calls_ != nullptr) calls_->remove(*this);
  }

 private:
  RunningCalls* const calls_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_RUNNING_CALLS_H_
