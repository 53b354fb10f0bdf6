#include "server/host/memory_lines.h"

#include <malloc.h>

#include <algorithm>
#include <limits>

namespace locus::server {
namespace {

constexpr uint64_t kPinnedShare = 4;
// The allocator may keep free memory up to 1 / kCacheShare of the limit, or up to kMinCacheBytes if that is more.
constexpr uint64_t kCacheShare = 8;
constexpr uint64_t kMinCacheBytes = uint64_t{64} << 20;
// gRPC's buffers may take up to 1 / kNetworkShare of the limit, or up to kMinNetworkBytes if that is more, which is
// enough for a few of the largest messages. Inserts and uploads leave the same share free (MemoryBudget::ceiling()).
constexpr uint64_t kNetworkShare = 8;
constexpr uint64_t kMinNetworkBytes = uint64_t{64} << 20;

}  // namespace

uint64_t short_memory(uint64_t limit) { return limit / 4 * 3; }
uint64_t pinned_ceiling(uint64_t limit) { return limit / kPinnedShare; }
uint64_t cache_ceiling(uint64_t limit) { return std::max(kMinCacheBytes, limit / kCacheShare); }
uint64_t network_ceiling(uint64_t limit) { return std::max(kMinNetworkBytes, limit / kNetworkShare); }

std::vector<MemoryLineUse> memory_lines(const MemoryBudget& budget, const Registry& registry, const UpdateLog* log) {
  const uint64_t limit = budget.limit(), growth = budget.ceiling(MemoryLine::kInserts);
  std::vector<MemoryLineUse> lines = {
      {"history", false, 0, short_memory(limit)},
      {"pinned", false, 0, pinned_ceiling(limit)},
      {"scenes", false, 0, growth},
      {"meshes", false, registry.mesh_bytes(), growth},
      {"caches", false, mallinfo2().fordblks + (log == nullptr ? 0 : log->cache_bytes()), cache_ceiling(limit)},
      {"network", false, 0, network_ceiling(limit)},
  };
  for (const ScenePtr& scene : registry.list_scenes("", std::numeric_limits<size_t>::max())) {
    const SceneStatus status = scene->status();
    lines[0].used += status.history_bytes;
    lines[1].used += status.pinned_bytes;
    lines[2].used += status.memory_bytes;
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
  const uint64_t used = budget.used();
  lines[5].used = used - std::min(used, known);
  return lines;
}

}  // namespace locus::server
