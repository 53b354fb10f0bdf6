// One ray against the triangles of one instance, one triangle at a time. For rays that the vector kernels leave
// undecided, and for queries that they do not support. Any thread, with a QueryTask and a collector of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_INSTANCE_RAYS_H_
#define LOCUS_CORE_QUERY_KINDS_INSTANCE_RAYS_H_

#include "core/query/kinds/hit_collector.h"
#include "core/query/kinds/query_task.h"
#include "core/query/kinds/ray_query.h"

namespace locus {

// Offers the ray's hits of `instance` to `collector`. `slabs` is the slab test of the ray in world axes. `nearest` is
// the t at which the ray enters the instance's bounds; no hit has a lower t. Cost: the nodes that the ray meets within
// the collector's limit, and the triangles below them.
void trace_instance(QueryTask& task, const RayRequest& request, const SlabRay<double>& slabs, const Instance& instance,
                    float nearest, HitCollector& collector);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_INSTANCE_RAYS_H_
