// Rays of one chunk of a batch against the scene's meshes, by the vector kernels, which need many rays per call. Each
// ray walks the tree over instances from near to far. In each round every ray advances to its next instance, the
// kernels trace the waiting rays mesh by mesh, and their hits shorten the rays. Supports EXACT rays of all modes.
//
// Threads: one thread per call.
#ifndef LOCUS_CORE_QUERY_KINDS_KERNEL_RAYS_H_
#define LOCUS_CORE_QUERY_KINDS_KERNEL_RAYS_H_

#include <vector>

#include "core/query/kinds/hit_collector.h"
#include "core/query/kinds/query_task.h"
#include "core/query/kinds/ray_query.h"

namespace locus {

// Ray in progress: its request, filter and hits so far.
struct PendingRay {
  PendingRay(const RayRequest& ray, const Filter& ray_filter) : request(ray), filter(ray_filter), collector(ray) {}

  RayRequest request;
  Filter filter;
  HitCollector collector;
};

// Offers the hits of each ray on the meshes to its collector. All rays have the same mode. Precondition: the task has
// ray kernels.
void trace_meshes(QueryTask& task, std::vector<PendingRay>& rays);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_KERNEL_RAYS_H_
