// Bytes of memory that the calls of each client have claimed on all of its connections together, so that a client
// gains nothing by opening more connections. A client is named by its identity.
//
// Threads: any thread may call of(). Invariant: all live pointers to a client's counter point to the same counter.
// Memory: the entries are split into kParts parts. When a part has twice as many entries as after its last cleanup, and
// at least kMinCleanup, a cleanup removes the entries of clients whose counters nobody holds.
#ifndef LOCUS_SERVER_SCHEDULING_CLIENT_SHARES_H_
#define LOCUS_SERVER_SCHEDULING_CLIENT_SHARES_H_

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "absl/container/flat_hash_map.h"
#include "absl/hash/hash.h"
#include "core/base/mutex.h"

namespace locus::server {

class ClientShares {
 public:
  using Counter = std::atomic<uint64_t>;

  // Returns the counter of a client: a new counter, which is 0, if nobody holds one. The counter may outlive this
  // object.
  std::shared_ptr<Counter> of(const std::string& client) {
    Part& part = parts_[absl::HashOf(client) % kParts];
    const MutexLock lock(part.mutex);
    std::weak_ptr<Counter>& entry = part.counters[client];
    std::shared_ptr<Counter> counter = entry.lock();
    if (counter != nullptr) return counter;
    counter = std::make_shared<Counter>(0);
    entry = counter;
    if (part.counters.size() >= part.cleanup_size) {
      absl::erase_if(part.counters, [](const auto& named) { return named.second.expired(); });
      part.cleanup_size = std::max(kMinCleanup, 2 * part.counters.size());
    }
    return counter;
  }

  // Returns the number of stored entries.
  size_t size() const {
    size_t size = 0;
    for (const Part& part : parts_) {
      const MutexLock lock(part.mutex);
      size += part.counters.size();
    }
    return size;
  }

 private:
  static constexpr size_t kParts = 16, kMinCleanup = 64;

  struct Part {
    mutable Mutex mutex;
    absl::flat_hash_map<std::string, std::weak_ptr<Counter>> counters LOCUS_GUARDED_BY(mutex);
    size_t cleanup_size LOCUS_GUARDED_BY(mutex) = kMinCleanup;
  };

  std::array<Part, kParts> parts_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SCHEDULING_CLIENT_SHARES_H_
