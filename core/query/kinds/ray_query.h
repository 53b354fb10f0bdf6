// One ray against everything in a snapshot: statics first, whose hit shortens the ray, then moving objects.
#ifndef LOCUS_CORE_QUERY_KINDS_RAY_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_RAY_QUERY_H_

#include <vector>

#include "absl/container/inlined_vector.h"
#include "core/query/kinds/hit.h"
#include "core/query/kinds/query_task.h"
#include "core/query/kinds/query_times.h"

namespace locus {

struct RayRequest {
  Vec3d origin;
  Vec3d direction;
  float t_max;
  RayMode mode;
  Cull cull;  // by the stored winding
  Inside inside;
  Source source;
  Precision precision;
  uint32_t max_results;  // of kAll
};

// The request of query `i` of a block of rays. `winding` turns the block's cull into the stored winding's.
RayRequest ray_request(const QueryBlock& block, const RayColumns& rays, Winding winding, size_t i);

struct RayAnswer {
  absl::InlinedVector<Hit, 1> hits;  // kFirst and kAny: at most one; kAll: ascending
  bool truncated = false;            // kAll: there were more; or the batch ended first
};
using RayAnswers = std::vector<RayAnswer>;

// The answers to queries `begin` to `end` (exclusive) of a block; they borrow `moments`. Many at once are answered
// faster than one by one.
RayAnswers run_rays(QueryTask& task, const QueryBlock& block, const RayColumns& rays, const QueryTimes& moments,
                    Winding winding, size_t begin, size_t end);

// Weights of the second and third vertex, and the unit normal to the triangle's front or out of the object, at a hit
// that run_ray() found with kExact. Recomputed from the stored primitive.
struct Surface {
  float u = 0, v = 0;
  Vec3d normal;
};
Surface surface_at(const RayRequest& request, const Hit& hit, Winding winding);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_RAY_QUERY_H_
