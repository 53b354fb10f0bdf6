// Rays of one piece of a batch against the scene's meshes, by the vector kernels, which want many rays at once. Every
// ray walks the tree over instances near to far; in each round the kernels take all rays that have come to an instance,
// mesh by mesh, and what they find shortens the rays. Rays of any mode, exact.
//
// Threads: one at a time.
#ifndef LOCUS_CORE_QUERY_KINDS_KERNEL_RAYS_H_
#define LOCUS_CORE_QUERY_KINDS_KERNEL_RAYS_H_

#include <vector>

#include "core/query/kinds/hit_collector.h"
#include "core/query/kinds/query_task.h"
#include "core/query/kinds/ray_query.h"

namespace locus {

// A ray that is being answered.
struct AskedRay {
  AskedRay(const RayRequest& asked, const Filter& whom) : request(asked), filter(whom), collector(asked) {}

  RayRequest request;
  Filter filter;
  HitCollector collector;
};

// Offers each ray's collector what it hits of the meshes. Only where the task has kernels.
void ask_meshes(QueryTask& task, std::vector<AskedRay>& rays);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_KERNEL_RAYS_H_
