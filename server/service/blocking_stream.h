// A bidirectional stream as a loop can use it: read() and write() block, on a thread of the stream's own, while gRPC's
// callback threads only pass things on. Reads one message ahead and no further, so a caller who does not read its
// answers is not read from. A read that waits ends when the server drains.
//
// Messages are parsed here rather than by gRPC, which would end a stream whose bytes are no message as if the caller
// had closed it.
//
// Threads: read() and write() on the stream's own thread only. Lifetime: the stream lives until gRPC is done with it
// and its thread has ended, whichever is later.
// Source of the reactor rules: gRPC C++ callback API, proposal L67 (Pai, 2020).
#ifndef LOCUS_SERVER_SERVICE_BLOCKING_STREAM_H_
#define LOCUS_SERVER_SERVICE_BLOCKING_STREAM_H_

#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include <functional>
#include <memory>
#include <utility>

#include "core/base/mutex.h"
#include "core/base/refusal.h"
#include "server/service/host.h"
#include "server/service/status.h"

namespace locus::server {

using RawReactor = grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>;

enum class ReadOutcome {
  kMessage,    // there is one
  kMalformed,  // there was one, but it is none of this type
  kEnd,        // the caller sends no more, or is gone
  kDraining,   // the server ends; everything read has been handed out
};

template <class Request, class Response>
class BlockingStream final : public RawReactor {
 public:
  // What the stream's thread does; its result ends the stream.
  using Body = std::function<absl::Status(BlockingStream&)>;

  // Begins the stream on a thread of host.streams, or refuses it. gRPC owns what comes back.
  static RawReactor* open(Host& host, Body body) {
    const std::shared_ptr<BlockingStream> stream(new BlockingStream());
    stream->self_ = stream;
    stream->StartRead(&stream->incoming_);
    if (host.drain.draining()) {
      stream->Finish(to_grpc(draining()));
    } else if (!host.streams.start([&host, stream, body = std::move(body)] { stream->run(host, body); })) {
      const auto max = static_cast<double>(host.streams.max());
      stream->Finish(to_grpc(refuse_full("", "streams", max, max + 1, kRetryAfterMs)));
    }
    return stream.get();
  }

  // Waits for the next message. Not again after anything but kMessage.
  ReadOutcome read(Request* request) LOCUS_EXCLUDES(mutex_) {
    grpc::ByteBuffer bytes;
    bool more = false;
    {
      MutexLock lock(mutex_);
      while (reading_ == Reading::kPending && !draining_) changed_.wait(mutex_);
      if (reading_ == Reading::kPending || reading_ == Reading::kStopped) return ReadOutcome::kDraining;
      if (reading_ == Reading::kOver) return ReadOutcome::kEnd;
      bytes.Swap(&incoming_);
      more = !draining_;
      reading_ = more ? Reading::kPending : Reading::kStopped;
    }
    if (more) {
      incoming_.Clear();
      this->StartRead(&incoming_);
    }
    const grpc::Status parsed = grpc::SerializationTraits<Request>::Deserialize(&bytes, request);
    return parsed.ok() ? ReadOutcome::kMessage : ReadOutcome::kMalformed;
  }

  // Waits until the message is on its way; false when the caller is gone.
  bool write(const Response& response) LOCUS_EXCLUDES(mutex_) {
    bool own = false;
    outgoing_.Clear();
    if (!grpc::SerializationTraits<Response>::Serialize(response, &outgoing_, &own).ok()) return false;
    {
      MutexLock lock(mutex_);
      writing_ = true;
    }
    this->StartWrite(&outgoing_);
    MutexLock lock(mutex_);
    while (writing_) changed_.wait(mutex_);
    return written_;
  }

 private:
  enum class Reading { kPending, kReady, kOver, kStopped };

  static constexpr uint32_t kRetryAfterMs = 1000;

  BlockingStream() = default;

  void run(Host& host, const Body& body) LOCUS_EXCLUDES(mutex_) {
    const Drain::Subscription subscription(host.drain, [this] {
      MutexLock lock(mutex_);
      draining_ = true;
      changed_.notify_all();
    });
    this->Finish(to_grpc(body(*this)));
  }

  void OnReadDone(bool ok) override LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    reading_ = ok ? Reading::kReady : Reading::kOver;
    changed_.notify_all();
  }

  void OnWriteDone(bool ok) override LOCUS_EXCLUDES(mutex_) {
    MutexLock lock(mutex_);
    writing_ = false;
    written_ = ok;
    changed_.notify_all();
  }

  // gRPC is done; the thread may hold the stream a little longer.
  void OnDone() override { const std::shared_ptr<BlockingStream> last = std::move(self_); }

  std::shared_ptr<BlockingStream> self_;
  grpc::ByteBuffer incoming_;  // gRPC's while reading_ is kPending
  grpc::ByteBuffer outgoing_;  // gRPC's while writing_
  Mutex mutex_;
  ConditionVariable changed_;
  Reading reading_ LOCUS_GUARDED_BY(mutex_) = Reading::kPending;
  bool writing_ LOCUS_GUARDED_BY(mutex_) = false;
  bool written_ LOCUS_GUARDED_BY(mutex_) = false;
  bool draining_ LOCUS_GUARDED_BY(mutex_) = false;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICE_BLOCKING_STREAM_H_
