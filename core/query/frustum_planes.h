// Planes of one query of a block of convex regions, computed from the columns of the block. Plain data; any thread.
#ifndef LOCUS_CORE_QUERY_FRUSTUM_PLANES_H_
#define LOCUS_CORE_QUERY_FRUSTUM_PLANES_H_

#include <array>

#include "absl/types/span.h"
#include "core/geometry/convex_region.h"
#include "core/query/query_batch.h"

namespace locus {

class FrustumPlanes {
 public:
  // kZeroNormal: a plane has a zero normal and a negative offset, so it excludes everything. kSingular: the determinant
  // of the matrix is 0.
  enum class Fault : uint8_t { kNone, kZeroNormal, kSingular };

  // Reads the planes of region `i` from `frustums`, whose values must be finite. The planes are relative to the origin
  // of the region. A plane with a zero normal is left out if it excludes nothing. The planes of a matrix are sums and
  // differences of its rows, computed in double.
  // Source: Gribb, Hartmann, Fast Extraction of Viewing Frustum Planes from the World-View-Projection Matrix, 2001.
  FrustumPlanes(const FrustumColumns& frustums, size_t i);

  absl::Span<const Plane> planes() const { return {planes_.data(), count_}; }
  Fault fault() const { return fault_; }

 private:
  void add(Vec3d normal, double offset);
  void read_matrix(const float* matrix, ClipDepth clip_depth);

  std::array<Plane, limits::kMaxPlanes> planes_;
  size_t count_ = 0;
  Fault fault_ = Fault::kNone;
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_FRUSTUM_PLANES_H_
