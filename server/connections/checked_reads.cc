#include "server/connections/checked_reads.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/string_view.h"
#include "core/base/mutex.h"
#include "server/connections/frame_check.h"

namespace locus::server {
namespace {

// Returns the cookie of a socket, a number that the kernel assigns to no other socket; 0 if `descriptor` is not a
// socket.
uint64_t cookie_of(int descriptor) {
  uint64_t cookie = 0;
  socklen_t size = sizeof cookie;
  return getsockopt(descriptor, SOL_SOCKET, SO_COOKIE, &cookie, &size) == 0 ? cookie : 0;
}

struct WatchedSocket {
  CheckedReads* owner = nullptr;
  uint64_t cookie = 0;
  std::shared_ptr<Connection> connection;
  FrameCheck check;
  bool is_refused = false;
};

// Watched sockets of the process whose descriptors have the same remainder modulo kShards.
struct Shard {
  Mutex mutex;
  absl::flat_hash_map<int, WatchedSocket> sockets LOCUS_GUARDED_BY(mutex);
};

constexpr size_t kShards = 64;

std::array<Shard, kShards>& shards() {
  // Never destroyed: threads may read until the process ends.
  static auto* const kMade = new std::array<Shard, kShards>;
  return *kMade;
}

Shard& shard_of(int descriptor) { return shards()[static_cast<size_t>(descriptor) % kShards]; }

// Passes the `count` bytes that were read into `message` to `check`. Returns the reason of a refusal; null if all bytes
// are accepted.
const char* refusal(FrameCheck& check, const msghdr& message, size_t count) {
  const FrameCheck::Time now = std::chrono::steady_clock::now();
  for (size_t i = 0; i < message.msg_iovlen && count > 0; ++i) {
    const size_t size = std::min(count, message.msg_iov[i].iov_len);
    const char* reason = check.refusal({static_cast<const char*>(message.msg_iov[i].iov_base), size}, now);
    if (reason != nullptr) return reason;
    count -= size;
  }
  return nullptr;
}

}  // namespace

CheckedReads::~CheckedReads() {
  for (Shard& shard : shards()) {
    const MutexLock lock(shard.mutex);
    absl::erase_if(shard.sockets, [this](const auto& entry) { return entry.second.owner == this; });
  }
}

void CheckedReads::watch(int descriptor, std::shared_ptr<Connection> connection) {
  Shard& shard = shard_of(descriptor);
  const MutexLock lock(shard.mutex);
  shard.sockets.insert_or_assign(descriptor,
                                 WatchedSocket{this, cookie_of(descriptor), std::move(connection), FrameCheck()});
}

void CheckedReads::forget(int descriptor) {
  Shard& shard = shard_of(descriptor);
  const MutexLock lock(shard.mutex);
  shard.sockets.erase(descriptor);
}

bool CheckedReads::accept(int descriptor, const msghdr& message, size_t count) {
  if (descriptor < 0) return true;
  Shard& shard = shard_of(descriptor);
  const MutexLock lock(shard.mutex);
  const auto found = shard.sockets.find(descriptor);
  if (found == shard.sockets.end()) return true;
  WatchedSocket& socket = found->second;
  if (socket.cookie != cookie_of(descriptor)) {
    shard.sockets.erase(found);
    return true;
  }
  if (socket.is_refused) return false;
  const char* reason = refusal(socket.check, message, count);
  if (reason == nullptr) return true;
  socket.is_refused = true;
  socket.owner->on_refused_(*socket.connection, reason);
  return false;
}

}  // namespace locus::server
