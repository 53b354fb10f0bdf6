#include "server/scheduling/allocator_use.h"

#include <malloc.h>

#include <algorithm>
#include <cstdlib>

#include "core/base/large_array.h"
#include "core/base/mutex.h"

namespace locus::server {
namespace {

constexpr int kMmapThreshold = 64 << 20;
constexpr int kTopPad = 16 << 20;
// Settings while a top is returned.
constexpr int kLowTrimThreshold = 1 << 20;
constexpr int kLowTopPad = 128 << 10;
// Size of a block whose free() makes glibc look at the top: more than its FASTBIN_CONSOLIDATION_THRESHOLD of 64 KiB.
constexpr size_t kLargeBlock = 128 << 10;

Mutex settings_mutex;
int trim_threshold LOCUS_GUARDED_BY(settings_mutex) = 0;  // 0: keep_freed_memory() was not called

}  // namespace

void keep_freed_memory(uint64_t memory_limit) {
  const MutexLock lock(settings_mutex);
  trim_threshold = static_cast<int>(std::min(uint64_t{512} << 20, memory_limit / 8));
  mallopt(M_MMAP_THRESHOLD, kMmapThreshold);
  mallopt(M_TRIM_THRESHOLD, trim_threshold);
  mallopt(M_TOP_PAD, kTopPad);
}

AllocatorUse allocator_use(uint64_t resident) {
  const struct mallinfo2 info = mallinfo2();
  AllocatorUse use;
  use.live = info.uordblks + info.hblkhd + mapped_array_bytes();
  use.reusable = std::min<uint64_t>(info.fordblks, resident - std::min<uint64_t>(resident, use.live));
  return use;
}

void return_free_memory() { malloc_trim(0); }

void return_top_of_arena() {
  const MutexLock lock(settings_mutex);
  if (trim_threshold == 0) return;
  void* volatile block = std::malloc(kLargeBlock);  // NOLINT: volatile, so that the calls are not optimised away
  mallopt(M_TOP_PAD, kLowTopPad);
  mallopt(M_TRIM_THRESHOLD, kLowTrimThreshold);
  std::free(block);
  mallopt(M_TRIM_THRESHOLD, trim_threshold);
  mallopt(M_TOP_PAD, kTopPad);
}

}  // namespace locus::server
