// What work costs in memory, and what the process holds: the numbers behind the limit memory_bytes. Costs are those of
// the peak, measured on this version and rounded up; they need not be exact, since the process itself is measured again
// and again.
//
// Threads: everything may be called from any thread.
#ifndef LOCUS_SERVER_HOST_MEMORY_USE_H_
#define LOCUS_SERVER_HOST_MEMORY_USE_H_

#include <cstdint>

#include "core/scene/registry.h"
#include "core/scene/statics/static_set.h"
#include "core/scene/updates/update_batch.h"
#include "server/scheduling/memory_budget.h"

namespace locus::server {

// The process's resident memory. Gives back the revisions that scenes keep besides their latest, and what the allocator
// keeps of freed memory. `registry` must outlive it.
MemoryBudget::Meter process_memory(const Registry& registry);

struct UpdateCost {
  uint64_t bytes = 0;
  bool inserts = false;
};
// Before the batch's form is checked: any length of its lists is fine.
UpdateCost cost_of(const UpdateBatch& batch);

// From the first column to the built tree.
uint64_t upload_cost(uint32_t vertices, uint32_t triangles);

// Of the set that `change` makes from `statics`. Nothing for a change that places nothing.
uint64_t change_cost(const StaticSet& statics, const StaticChange& change);

}  // namespace locus::server

#endif  // LOCUS_SERVER_HOST_MEMORY_USE_H_
