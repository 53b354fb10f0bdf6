// Intersection of rays with a snapshot. Static instances are searched first, because their hits limit the part of a ray
// in which moving objects are searched. Free functions; any thread may call them with a QueryTask of its own.
#ifndef LOCUS_CORE_QUERY_KINDS_RAY_QUERY_H_
#define LOCUS_CORE_QUERY_KINDS_RAY_QUERY_H_

#include <limits>
#include <vector>

#include "absl/container/inlined_vector.h"
#include "absl/functional/function_ref.h"
#include "core/query/kinds/hit.h"
#include "core/query/kinds/query_origins.h"
#include "core/query/kinds/query_task.h"
#include "core/query/kinds/query_times.h"

namespace locus {

struct RayRequest {
  Vec3d origin;
  Vec3d direction;
  float t_max;
  RayMode mode;
  Cull cull;  // side of triangles that the ray ignores, given for the stored winding
  Inside inside;
  Source source;
  Precision precision;
  uint32_t max_results;  // kAll only
  bool count_only;       // kAll only
  RowPosition after;     // only rows after this position are returned
};

// Reader of the requests of a block of rays. The fields that are equal for all queries of the block are computed
// once. Borrows the columns and the origins. Const access; any thread.
class RayReader {
 public:
  // Converts the block's cull from the scene's `winding` to the stored counter-clockwise winding.
  RayReader(const QueryBlock& block, const RayColumns& rays, const QueryOrigins& origins, Winding winding);

  RayRequest request(size_t i) const {
    RayRequest request = common_;
    request.origin = origins_.of(i) + read_vec3d(starts_.entry(i));
    request.direction = read_vec3d(directions_.entry(i));
    if (is_rotated_) request.direction = rotation_.to_world(request.direction);
    request.t_max = limits_.value(i, std::numeric_limits<float>::infinity());
    if (after_ != nullptr) request.after = RowPosition::of(*after_, i);
    return request;
  }

 private:
  RayRequest common_{};
  const QueryOrigins& origins_;
  const ColumnReader<float> starts_, directions_, limits_;
  const AfterColumns* after_;  // null if no query has a position `after`
  const bool is_rotated_;      // whether `rotation_` is applied to directions
  const Rotation rotation_;
};

struct RayAnswer {
  absl::InlinedVector<Hit, 1> hits;  // kFirst and kAny: at most one; kAll: in the order of nearer()
  bool truncated = false;            // kAll: more hits exist; any mode: the batch ended during the search
  uint64_t count = 0;                // count_only: number of hits; `hits` is then empty
};
using RayAnswers = std::vector<RayAnswer>;

// Answers queries [begin, end) of a block. The answers borrow `times`. One call for many rays is faster than many
// calls, because the kernels trace many rays together.
RayAnswers run_rays(QueryTask& task, const QueryBlock& block, const RayColumns& rays, const QueryTimes& times,
                    const QueryOrigins& origins, Winding winding, size_t begin, size_t end);

struct PendingRay;

// Finds the hits of each ray and offers them to the collector of the ray. All rays must have the same mode, precision
// and source. moment_of(i) returns the objects at the time of ray i. Sets is_cut for rays whose search is not complete
// because the batch ended.
void find_hits(QueryTask& task, std::vector<PendingRay>& rays, absl::FunctionRef<const SceneAtTime&(size_t)> moment_of);

// Surface at a hit: barycentric weights of the triangle's second (u) and third (v) vertex, and the unit normal of the
// triangle's front side or of the object's outside.
struct Surface {
  float u = 0, v = 0;
  Vec3d normal;
};
// Returns the surface at a hit of an EXACT ray, recomputed from the stored object or triangle. All values are zero for
// a miss and for a CONSERVATIVE ray.
Surface surface_at(const RayRequest& request, const Hit& hit, Winding winding);

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_KINDS_RAY_QUERY_H_
