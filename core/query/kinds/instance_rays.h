// Intersection of one ray with the triangles of one instance, one triangle at a time. Used for rays that the vector
// kernels leave undecided or do not support. Any thread may call trace_instance() with a QueryTask and a collector of
// its own.
#ifndef LOCUS_CORE_QUERY_KINDS_INSTANCE_RAYS_H_
#define LOCUS_CORE_QUERY_KINDS_INSTANCE_RAYS_H_

#include "core/query/kinds/hit_collector.h"
#include "core/query/kinds/query_task.h"
#include "core/query/kinds/ray_query.h"

namespace locus {

// Offers the ray's hits on triangles of `instance` to `collector`. `slabs` is the ray in world axes, prepared for
// tests against boxes. `nearest` is the t at which the ray enters the instance's bounds; no hit has a lower t. Cost:
// one test for each tree node that the ray enters within the collector's limit, and one test for each triangle in the
// leaves among these nodes.
void trace_instance(QueryTask& task, const RayRequest& request, const SlabRay<double>& slabs, const Instance& instance,
                    float nearest, HitCollector& collector);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_INSTANCE_RAYS_H_
