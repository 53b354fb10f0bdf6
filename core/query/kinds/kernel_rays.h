// Intersection of many rays with the scene's static instances by the vector kernels, which are efficient only with
// many rays per call. Each ray visits the instances from near to far. All rays advance in rounds: each ray moves to
// its next instance, then the kernels trace all rays that wait at instances of the same mesh in one call. Once a
// ray's collector is full, the worst retained hit limits the t up to which the ray is traced. Supports EXACT rays of
// all modes, but not RayRequest::after.
//
// Threads: any thread may call trace_meshes() with a QueryTask and rays of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_KERNEL_RAYS_H_
#define LOCUS_CORE_QUERY_KINDS_KERNEL_RAYS_H_

#include <vector>

#include "core/query/kinds/hit_collector.h"
#include "core/query/kinds/query_task.h"
#include "core/query/kinds/ray_query.h"

namespace locus {

// Ray in progress: its request, its filter, and the hits found so far.
struct PendingRay {
  PendingRay(const RayRequest& ray, const Filter& ray_filter) : request(ray), filter(ray_filter), collector(ray) {}
  // Constructs the pending ray of query `i` of `block`; `reader` is the reader of this block. Constructs the members
  // in place, because copying them right after they were written in parts would stall the processor.
  PendingRay(const RayReader& reader, const QueryBlock& block, size_t i)
      : request(reader.request(i)), filter(block, i), collector(request) {}

  RayRequest request;
  Filter filter;
  HitCollector collector;
  bool is_cut = false;  // the batch ended before the search of this ray was complete
};

// Finds the hits of each ray on static instances and offers them to the ray's collector. Preconditions: all rays are
// EXACT, have the same mode and no position `after`, and task.ray_kernels() is not null.
// moment_of(i) returns the scene at the time of ray i.
void trace_meshes(QueryTask& task, std::vector<PendingRay>& rays,
                  absl::FunctionRef<const SceneAtTime&(size_t)> moment_of);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_KERNEL_RAYS_H_
