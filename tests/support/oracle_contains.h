// Oracle of contains queries, which find the objects and closed meshes around points. It works in the slow and simple
// way that query_oracle.h describes: it tests everything, sorts and truncates. Used by tests of queries.
#ifndef LOCUS_TESTS_SUPPORT_ORACLE_CONTAINS_H_
#define LOCUS_TESTS_SUPPORT_ORACLE_CONTAINS_H_

#include <algorithm>

#include "core/geometry/point_in_mesh.h"
#include "tests/support/oracle_scene.h"

namespace locus::test {

// Returns whether the mesh of the instance winds around the point or has the point on its surface. The mesh must be
// closed.
inline bool winds_around(const Instance& instance, Vec3d point) {
  const Vec3d local = without_tiny_coordinates(instance.transform.point_to_mesh(point));
  int64_t winding = 0;
  for (uint32_t number = 0; number < instance.mesh->triangle_count(); ++number) {
    const Crossing found = crossing(local, instance.mesh->triangle(number));
    if (found.on_surface) return true;
    winding += found.winding;
  }
  return winding != 0;
}

inline void answer_block(const OracleScene& scene, const QueryBlock& block, const ContainsColumns& contains,
                         BlockResult& result) {
  const bool exactly = block.precision == Precision::kExact;
  for (size_t i = 0; i < contains.points.size() / 3; ++i) {
    const Vec3d point = scene.point(block, contains.points, i);
    OracleScene::Rows rows;
    for (const Instance* instance : scene.instances_) {
      if (block.source == Source::kDynamic || instance->id <= block.after_id || !scene.wanted(block, i, *instance))
        continue;
      if (instance->mesh->open_edges() != 0 || squared_distance(point, instance->bounds) > 0) continue;
      if (exactly && !winds_around(*instance, point)) continue;
      rows.push_back({0, instance->id, kNoTriangle, 0, nullptr, instance, 0, 0, {}, {}});
    }
    for (const OracleScene::OracleObject& object : scene.objects_) {
      if (block.source == Source::kStatic || object.id <= block.after_id || !scene.wanted(block, i, object)) continue;
      if (squared_distance(point, bounds_of(object.shape)) > 0) continue;
      if (exactly && !ball_overlaps(Balld{point, 0}, object.shape)) continue;
      const bool is_known = !rows.empty() && rows.back().id == object.id;  // by another part
      if (!is_known) rows.push_back({0, object.id, kNoTriangle, 0, scene.whole_of(object.id), nullptr, 0, 0, {}, {}});
    }
    std::sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
    OracleScene::count(block, rows, i, result);
    for (const OracleScene::Row& row : rows) OracleScene::write(row, block, result);
  }
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_ORACLE_CONTAINS_H_
