#include "core/query/frustum_planes.h"

#include <utility>

#include "core/base/check.h"
#include "core/base/planted_bug.h"

namespace locus {
namespace {

// Row of a matrix: (x, y, z) and w.
struct Row {
  Vec3d xyz;
  double w;

  friend Row operator+(const Row& a, const Row& b) { return {a.xyz + b.xyz, a.w + b.w}; }
  friend Row operator-(const Row& a, const Row& b) { return {a.xyz - b.xyz, a.w - b.w}; }
};

// Returns the determinant of the matrix with the rows `rows`, computed from the 2 x 2 minors of the first two rows
// and of the last two rows.
double determinant(const Row (&rows)[4]) {
  const auto minor = [](const Row& a, const Row& b, int i, int j) {
    const auto at = [](const Row& row, int k) { return k == 3 ? row.w : row.xyz[k]; };
    return at(a, i) * at(b, j) - at(a, j) * at(b, i);
  };
  const Row &a = rows[0], &b = rows[1], &c = rows[2], &d = rows[3];
  return minor(a, b, 0, 1) * minor(c, d, 2, 3) - minor(a, b, 0, 2) * minor(c, d, 1, 3) +
         minor(a, b, 0, 3) * minor(c, d, 1, 2) + minor(a, b, 1, 2) * minor(c, d, 0, 3) -
         minor(a, b, 1, 3) * minor(c, d, 0, 2) + minor(a, b, 2, 3) * minor(c, d, 0, 1);
}

}  // namespace

FrustumPlanes::FrustumPlanes(const FrustumColumns& frustums, size_t i) {
  if (!frustums.view_projections.empty()) {
    read_matrix(&frustums.view_projections[16 * i], frustums.clip_depth);
    return;
  }
  const size_t each = frustums.planes_per_region();
  LOCUS_DCHECK_LE(4 * each * (i + 1), frustums.planes.size());
  for (size_t k = 0; k < each; ++k) {
    const float* const plane = &frustums.planes[4 * (each * i + k)];
    add(read_vec3d(plane), double{plane[3]});
  }
}

void FrustumPlanes::add(Vec3d normal, double offset) {
  if (normal == Vec3d{}) {
    if (offset < 0) fault_ = Fault::kZeroNormal;
    return;
  }
  LOCUS_DCHECK_LT(count_, planes_.size());
  planes_[count_++] = normalized_plane(normal, offset);
}

void FrustumPlanes::read_matrix(const float* matrix, ClipDepth clip_depth) {
  Row rows[4];
  for (int row = 0; row < 4; ++row)
    rows[row] = {{matrix[row], matrix[4 + row], matrix[8 + row]}, double{matrix[12 + row]}};
  if (determinant(rows) == 0) {
    fault_ = Fault::kSingular;
    return;
  }
  if (planted(PlantedBug::kMatrixRow)) std::swap(rows[0], rows[1]), rows[1] = rows[0];
  const Row near = clip_depth == ClipDepth::kZeroToOne ? rows[2] : rows[3] + rows[2];
  for (const Row& plane :
       {rows[3] + rows[0], rows[3] - rows[0], rows[3] + rows[1], rows[3] - rows[1], near, rows[3] - rows[2]})
    add(plane.xyz, plane.w);
}

}  // namespace locus
