// Estimates of the memory that a piece of work needs, and a measurement of the process's memory, for the limit
// memory_bytes. An estimate is the peak, measured on this version and rounded up. It need not be exact, because the
// memory of the process itself is measured repeatedly.
//
// Threads: every function may be called from any thread.
#ifndef LOCUS_SERVER_HOST_MEMORY_USE_H_
#define LOCUS_SERVER_HOST_MEMORY_USE_H_

#include <cstdint>

#include "core/scene/registry.h"
#include "core/scene/statics/static_set.h"
#include "core/scene/updates/update_batch.h"
#include "server/scheduling/memory_budget.h"

namespace locus::server {

// Returns a meter of the process's resident memory. Its release_memory() drops the revisions that scenes keep besides
// their latest, and returns the allocator's free memory to the kernel. `registry` must outlive the meter.
MemoryBudget::Meter process_memory(const Registry& registry);

// Memory in bytes that applying a batch needs, and whether the batch may be refused for it because it inserts objects.
struct UpdateCost {
  uint64_t bytes = 0;
  bool inserts = false;
};
// Returns the cost of a batch whose form is not checked yet: its lists may have any length.
UpdateCost cost_of(const UpdateBatch& batch);

// Returns the peak memory in bytes of an upload, from its first column to the built tree.
uint64_t upload_cost(uint32_t vertices, uint32_t triangles);

// Returns the size in bytes of the new set of instances that results from applying `change` to `statics`. Returns 0 for
// a change without placements, which is never refused.
uint64_t change_cost(const StaticSet& statics, const StaticChange& change);

}  // namespace locus::server

#endif  // LOCUS_SERVER_HOST_MEMORY_USE_H_
