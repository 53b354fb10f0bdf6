#include "server/host/memory_lines.h"

#include <algorithm>
#include <limits>

#include "server/scheduling/allocator_use.h"

namespace locus::server {
namespace {

constexpr uint64_t kPinnedShare = 4;
// The caches of the log may take 1 / kCacheShare of the limit, or kMinCacheBytes if that is more.
constexpr uint64_t kCacheShare = 8;
constexpr uint64_t kMinCacheBytes = uint64_t{64} << 20;
// The allocator of an idle process may keep 1 / kSpareShare of the live bytes free, or kMinSpareBytes if that is more.
constexpr uint64_t kSpareShare = 16;
constexpr uint64_t kMinSpareBytes = uint64_t{8} << 20;
// gRPC's buffers may take up to 1 / kNetworkShare of the limit, or up to kMinNetworkBytes if that is more, which is
// enough for a few of the largest messages. Inserts and uploads leave the same share free (MemoryBudget::ceiling()).
constexpr uint64_t kNetworkShare = 8;
constexpr uint64_t kMinNetworkBytes = uint64_t{64} << 20;

}  // namespace

uint64_t short_memory(uint64_t limit) { return limit / 4 * 3; }
uint64_t pinned_ceiling(uint64_t limit) { return limit / kPinnedShare; }
uint64_t cache_ceiling(uint64_t limit) { return std::max(kMinCacheBytes, limit / kCacheShare); }
uint64_t spare_ceiling(uint64_t limit, uint64_t live) {
  return std::min(limit, std::max(kMinSpareBytes, live / kSpareShare));
}
uint64_t network_ceiling(uint64_t limit) { return std::max(kMinNetworkBytes, limit / kNetworkShare); }

std::vector<MemoryLineUse> memory_lines(const MemoryBudget& budget, const Registry& registry, const UpdateLog* log) {
  const uint64_t limit = budget.limit(), growth = budget.ceiling(MemoryLine::kInserts);
  const uint64_t used = budget.used();
  const AllocatorUse allocator = allocator_use(used);
  std::vector<MemoryLineUse> lines = {
      {"history", false, 0, short_memory(limit)},
      {"pinned", false, 0, pinned_ceiling(limit)},
      {"scenes", false, 0, growth},
      {"meshes", false, registry.mesh_bytes(), growth},
      {"caches", false, log == nullptr ? 0 : log->cache_bytes(), cache_ceiling(limit)},
      {"reusable", false, allocator.reusable, spare_ceiling(limit, allocator.live)},
      {"network", false, 0, network_ceiling(limit)},
  };
  for (const ScenePtr& scene : registry.list_scenes("", std::numeric_limits<size_t>::max())) {
    const SceneStatus status = scene->status();
    lines[0].used += status.history_bytes;
    lines[1].used += status.pinned_bytes;
    lines[2].used += status.memory_bytes;
    if (status.recorded_ticks == 0) lines[2].used += status.recent_bytes;  // else the history contains most of it
  }
  uint64_t known = 0;
  for (const MemoryLineUse& line : lines) known += line.used;
  for (size_t i = 0; i < kMemoryLines; ++i) {
    const auto line = static_cast<MemoryLine>(i);
    lines.push_back({std::string(memory_line_name(line)), true, budget.claimed(line), budget.ceiling(line)});
    known += lines.back().used;
  }
  // gRPC does not report the size of its buffers. So their line gets all memory that is in no other line, including the
  // program and the stacks.
  lines[6].used = used - std::min(used, known);
  return lines;
}

}  // namespace locus::server
