#include "core/query/kinds/overlap_columns.h"

#include "core/base/check.h"
#include "core/base/column.h"
#include "core/base/limits.h"
#include "core/query/kinds/query_task.h"

namespace locus {

OverlapOptions overlap_options(const QueryBlock& block, StaticDetail detail) {
  const uint32_t max_results = block.max_results == 0 ? limits::kDefaultMaxResults : block.max_results;
  return {block.source, block.precision, detail,
          max_results,  block.after_id,  block.count_only ? CountOnly::kYes : CountOnly::kNo};
}

Balld ball_of(Vec3d origin, const BallColumns& balls, size_t i) {
  LOCUS_DCHECK_LT(3 * i, balls.centers.size());
  return {origin + read_vec3d(ColumnReader<float>(balls.centers, 3).entry(i)),
          ColumnReader<float>(balls.radii, 1).value(i, 0)};
}

Obbd box_of(Vec3d origin, const BoxColumns& boxes, size_t i) {
  LOCUS_DCHECK_LT(3 * i, boxes.centers.size());
  return {origin + read_vec3d(ColumnReader<float>(boxes.centers, 3).entry(i)),
          read_vec3d(ColumnReader<float>(boxes.half_extents, 3).entry(i)), rotation_entry(boxes.rotations, i)};
}

Capsule capsule_of(Vec3d origin, const CapsuleColumns& capsules, size_t i) {
  LOCUS_DCHECK_LT(3 * i, capsules.starts.size());
  const Vec3d start = origin + read_vec3d(ColumnReader<float>(capsules.starts, 3).entry(i));
  const Vec3d end = origin + read_vec3d(ColumnReader<float>(capsules.ends, 3).entry(i));
  return {(start + end) * 0.5, (end - start) * 0.5, ColumnReader<float>(capsules.radii, 1).value(i, 0)};
}

}  // namespace locus
