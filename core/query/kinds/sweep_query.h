// Sweeps through a snapshot: the objects and triangles that moving balls, capsules and boxes touch. The static
// instances are searched first, because their hits limit the part of the path in which moving objects are searched.
// Free functions; any thread may call them with a QueryTask of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_SWEEP_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_SWEEP_QUERY_H_

#include "core/geometry/mover.h"
#include "core/query/kinds/ray_query.h"

namespace locus {

struct SweepRequest {
  Mover mover;  // in world axes
  RayMode mode;
  AtStart at_start;
  Source source;
  Precision precision;
  uint32_t max_results;  // kAll only
  bool count_only;       // kAll only
};

// Returns the request of query `i` of a block of sweeps. The positions of the query are relative to `origin`.
SweepRequest sweep_request(const QueryBlock& block, Vec3d origin, const SweepColumns& sweeps, size_t i);

// Answers one sweep. Objects are searched as of `moment`, which the answer borrows. Cost: visits of the nodes, cells
// and primitives near the path up to the last reported hit.
RayAnswer run_sweep(QueryTask& task, const SceneAtTime& moment, const SweepRequest& request, const Filter& filter);

// Returns the contact at a hit, recomputed from the stored object or triangle, in world axes. For a CONSERVATIVE sweep
// the normal is zero, and the point is the mover's centre at the hit.
Contact contact_of(const SweepRequest& request, const Hit& hit);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_SWEEP_QUERY_H_
