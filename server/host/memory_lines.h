// The lines of the memory budget as an operator sees them: each use of memory, with its ceiling. The memory of work in
// progress is claimed (server/scheduling/memory_budget.h); lasting data, such as scenes, is measured. All lines add up
// to about the memory of the process, because all memory that is in no other line belongs to the line `network`. The
// sum that the budget keeps below the memory limit can be larger than the sum of the lines, because it counts twice
// the memory that is both claimed and allocated.
//
// Plain functions; any thread. Cost: O(scenes + meshes + memory that pinned revisions do not share).
#ifndef LOCUS_SERVER_HOST_MEMORY_LINES_H_
#define LOCUS_SERVER_HOST_MEMORY_LINES_H_

#include <cstdint>
#include <string>
#include <vector>

#include "core/scene/log/update_log.h"
#include "core/scene/registry.h"
#include "server/scheduling/memory_budget.h"

namespace locus::server {

struct MemoryLineUse {
  std::string name;      // such as "history" or "replies"
  bool claimed = false;  // true: claimed before the memory exists; false: measured
  uint64_t used = 0;     // bytes
  // Bytes. For claimed lines, and for scenes and meshes: the memory use of the whole process above which they may not
  // grow. For history: the memory use of the whole process above which histories are shortened. For other lines: the
  // maximum size of the line itself.
  uint64_t ceiling = 0;
};

// Returns all lines: first the measured ones, then the claimed ones in the order in which their claims are refused as
// memory runs short. `log` may be null.
std::vector<MemoryLineUse> memory_lines(const MemoryBudget& budget, const Registry& registry, const UpdateLog* log);

// Returns the memory use of the whole process above which memory is short, so that histories are shortened.
uint64_t short_memory(uint64_t limit);
// Returns the bytes that pinned revisions of all scenes may hold while memory is short.
uint64_t pinned_ceiling(uint64_t limit);
// Returns the bytes that the caches of the log may take.
uint64_t cache_ceiling(uint64_t limit);
// Returns the bytes of free memory that the allocator of an idle process may keep, if `live` bytes are allocated.
uint64_t spare_ceiling(uint64_t limit, uint64_t live);
// Returns the bytes that gRPC's buffers may take, for messages in transit and for frames that no call has claimed.
uint64_t network_ceiling(uint64_t limit);

}  // namespace locus::server

#endif  // LOCUS_SERVER_HOST_MEMORY_LINES_H_
