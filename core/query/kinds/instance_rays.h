// One ray against the triangles of one instance, one triangle at a time: what the kernels leave undecided, and what
// they are not made for.
#ifndef LOCUS_CORE_QUERY_KINDS_INSTANCE_RAYS_H_
#define LOCUS_CORE_QUERY_KINDS_INSTANCE_RAYS_H_

#include "core/query/kinds/hit_collector.h"
#include "core/query/kinds/query_task.h"
#include "core/query/kinds/ray_query.h"

namespace locus {

// `slabs`: of the ray in world axes. `nearest`: where it enters the instance's bounds; no hit lies before. Cost: the
// nodes that the ray meets within the collector's limit and the triangles below them.
void ask_instance(QueryTask& task, const RayRequest& request, const SlabRay<double>& slabs, const Instance& instance,
                  float nearest, HitCollector& collector);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_INSTANCE_RAYS_H_
