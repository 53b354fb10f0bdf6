// Oracle that answers blocks of queries in the slow and simple way: tests every object and every triangle by the
// predicates of core/geometry, collects the results in one list, sorts the list and truncates it. Shares with
// core/query only the bounds of placed triangles, the planes of frustums, and the test whether a triangle is beyond a
// plane of a cell.
#ifndef LOCUS_TESTS_SUPPORT_QUERY_ORACLE_H_
#define LOCUS_TESTS_SUPPORT_QUERY_ORACLE_H_

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "core/geometry/nearest_pair.h"
#include "core/geometry/shape_distance.h"
#include "core/geometry/sweep.h"
#include "core/geometry/swept_bounds.h"
#include "core/query/frustum_planes.h"
#include "core/query/kinds/cell_query.h"
#include "core/query/kinds/placed_triangle.h"
#include "tests/support/oracle_contains.h"
#include "tests/support/oracle_pairs.h"
#include "tests/support/oracle_rays.h"
#include "tests/support/oracle_scene.h"

namespace locus::test {

class QueryOracle : public RayOracle {
 public:
  using RayOracle::RayOracle;

  // Answers a block without a limit on the size of the reply.
  BlockResult answer(const QueryBlock& block) const {
    BlockResult result = block.count_only ? counts_of(block) : rows_of(block);
    for (size_t i = 0; i < (block.anchor_ids.empty() ? 0 : query_count(block)); ++i)
      if (is_unanchored(block, i)) result.unanchored.push_back(static_cast<uint32_t>(i));
    return result;
  }

 private:
  using RayOracle::answer_kind;

  BlockResult rows_of(const QueryBlock& block) const {
    BlockResult result;
    std::visit([&](const auto& kind) { answer_kind(block, kind, result); }, block.kind);
    return result;
  }
  // Returns only the number of rows of each query, counted without any limit.
  BlockResult counts_of(QueryBlock block) const {
    block.count_only = false;
    block.max_results = std::numeric_limits<uint32_t>::max();
    block.columns = {Column::kId};
    if (auto* const nearest = std::get_if<NearestColumns>(&block.kind))
      nearest->count = std::numeric_limits<uint32_t>::max();
    BlockResult counts;
    counts.counts = rows_of(block).counts;
    return counts;
  }

  // Builds each cell plane by plane, from the nearest object or triangle to the farthest.
  void answer_kind(const QueryBlock& block, const CellColumns& cells, BlockResult& result) const {
    const bool conservative = block.precision == Precision::kConservative;
    for (size_t i = 0; i < cells.points.size() / 3; ++i) {
      const Vec3d from = point(block, cells.points, i);
      Rows rows;
      for (const Instance* instance : instances_)
        if (block.source != Source::kDynamic && wanted(block, i, *instance))
          near_rows(from, *instance, true, conservative, rows);
      for (const OracleObject& object : objects_)
        if (block.source != Source::kStatic && wanted(block, i, object)) near_row(from, object, conservative, rows);
      const float farthest = entry_for(cells.max_distances, i, 0.0f);
      std::erase_if(rows, [&](const Row& row) { return row.t > farthest; });
      std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
        return std::tie(a.t, a.id, a.triangle) < std::tie(b.t, b.id, b.triangle);
      });
      write_cell(block, cells, i, from, rows, result);
    }
  }

  void write_cell(const QueryBlock& block, const CellColumns& cells, size_t i, Vec3d from, const Rows& rows,
                  BlockResult& result) const {
    const size_t most = cells.max_planes == 0 ? 32 : cells.max_planes;
    Rows planes = {{entry_for(cells.max_distances, i, 0.0f), 0, kNoTriangle, 0, nullptr, nullptr, 0, 0, {}, {}}};
    for (const Row& row : rows) {
      if (row.t == 0 || row.normal == Vec3d{}) planes.clear();
      if (planes.empty()) break;
      const bool beyond = std::any_of(planes.begin() + 1, planes.end(),
                                      [&](const Row& plane) { return is_beyond_plane(plane, row, from, block); });
      if (beyond) continue;
      if (planes.size() > most) {
        planes[0].t = row.t;
        result.truncated.push_back(static_cast<uint32_t>(i));
        break;
      }
      planes.push_back(row);
    }
    if (is_unanchored(block, i)) planes.clear();
    result.counts.push_back(static_cast<uint32_t>(planes.size()));
    for (const Row& plane : planes) {
      write(plane, block, result);
      const ColumnSet columns = columns_of(block);
      const Vec3d normal = plane.id == 0 ? Vec3d{} : normalized(plane.normal);
      if (columns.has(Column::kNormal)) write_vector(to_float(normal + Vec3d{}), result.normals);
      if (columns.has(Column::kPoint)) write_vector(to_float(from - block.frame + plane.normal), result.points);
    }
  }

  // Returns whether the primitive of `row` lies on or beyond `plane`, with the predicates that queries apply to single
  // triangles and shapes.
  static bool is_beyond_plane(const Row& plane, const Row& row, Vec3d from, const QueryBlock& block) {
    const CellPlane cell{{}, plane.normal, normalized(plane.normal)};
    if (row.instance != nullptr) {
      Hit hit = locus::hit_on(*row.instance, row.t);
      hit.triangle = row.triangle;
      return is_beyond(cell, from, block.precision, hit);
    }
    // is_beyond() needs a reference into the grid, which an object of another time does not have. So compute the extent
    // of the object along the normal here.
    Shape shape = row.object->shape;
    const Aabbd bounds = bounds_of(shape);
    shape.position = shape.position - from;
    const double at = dot(cell.normal, cell.offset);
    const double least = block.precision == Precision::kConservative
                             ? least_along(cell.normal, Aabbd{bounds.min - from, bounds.max - from})
                             : least_along(cell.normal, shape);
    const double size =
        max_component(abs(shape.position)) + max_component(abs(to_double(shape.size))) * 2 + double{shape.radius};
    return least >= at - 0x1p-40 * (size + at + max_component(abs(from)) * 0x1p-8);
  }

  // Answers the kinds whose oracle is in a file of its own.
  template <class Columns>
  void answer_kind(const QueryBlock& block, const Columns& columns, BlockResult& result) const {
    answer_block(*this, block, columns, result);
  }

  static bool meets(const Balld& ball, const Aabbd& bounds) { return reaches(ball, bounds); }
  static bool meets(const Obbd& box, const Aabbd& bounds) { return overlaps(bounds_of(box), bounds); }
  static bool meets(const Balld& ball, const Shape& shape) { return ball_overlaps(ball, shape); }
  static bool meets(const Capsule& capsule, const Aabbd& bounds) { return reaches(capsule, bounds); }
  static bool meets(const Capsule& capsule, const Shape& shape) { return capsule_overlaps(capsule, shape); }
  static bool meets(const Capsule& capsule, const Triangle& triangle) { return capsule_overlaps(capsule, triangle); }
  static bool meets(const Obbd& box, const Shape& shape) { return box_overlaps(box, shape); }
  static bool meets(const ConvexRegion& region, const Aabbd& bounds) { return may_overlap(region, bounds); }
  static bool meets(const ConvexRegion& region, const Shape& shape) { return region_overlaps(region, shape); }
  static bool meets(const RegionInMesh& region, const Triangle& triangle) { return region.overlaps(triangle); }
  static bool meets(const Ballf& ball, const Triangle& triangle) { return ball_overlaps(ball, triangle); }
  static bool meets(const Obbf& box, const Triangle& triangle) { return box_overlaps(box, triangle); }
  static Ballf in_mesh(const Balld& ball, const Transform& transform) {
    return {to_float(transform.point_to_mesh(ball.center)), static_cast<float>(ball.radius / transform.scale)};
  }
  static Obbf in_mesh(const Obbd& box, const Transform& transform) {
    return {to_float(transform.point_to_mesh(box.center)), to_float(box.half * (1.0 / transform.scale)),
            compose(inverse(transform.rotation), box.rotation)};
  }
  static Capsule in_mesh(const Capsule& capsule, const Transform& transform) {
    return {transform.point_to_mesh(capsule.center),
            transform.rotation.to_local(capsule.half_axis) * (1.0 / transform.scale),
            capsule.radius * (1.0 / transform.scale)};
  }
  static double reach(const Capsule& capsule) {
    return max_component(abs(capsule.center)) + max_component(abs(capsule.half_axis)) + capsule.radius;
  }
  static double reach(const ConvexRegion& region) { return max_component(abs(region.origin())); }
  static double reach(const Balld& ball) { return max_component(abs(ball.center)) + ball.radius; }
  static double reach(const Obbd& box) { return max_component(abs(box.center)) + 2 * max_component(box.half); }

  // Returns whether a solid overlaps the bounds of an instance. A capsule is replaced by its bounds for this test.
  static bool may_meet(const Capsule& capsule, const Aabbd& bounds) { return overlaps(bounds_of(capsule), bounds); }
  template <class Solid>
  static bool may_meet(const Solid& solid, const Aabbd& bounds) {
    return meets(solid, bounds);
  }

  template <class Solid>
  void overlap_rows(const QueryBlock& block, StaticDetail detail, const Solid& solid, const Instance& instance,
                    Rows& rows) const {
    if (!may_meet(solid, instance.bounds)) return;
    const PlacedTriangles placed(instance);
    const LoosePlacedTriangles loose(instance, reach(solid));
    const auto mesh_solid = [&] {
      if constexpr (std::is_same_v<Solid, ConvexRegion>)
        return RegionInMesh(solid, instance.transform, magnitude(instance.mesh->bounds()));
      else
        return in_mesh(solid, instance.transform);
    }();
    const std::vector<uint32_t>& storage = storage_.at(instance.mesh.get());
    for (uint32_t number = 0; number < instance.mesh->triangle_count(); ++number) {
      const Triangle triangle = instance.mesh->triangle(number);
      const bool exactly = meets(mesh_solid, triangle) && meets(solid, loose.bounds_of_triangle(triangle));
      const bool by_bounds = block.precision == Precision::kConservative;
      if (!exactly && !(by_bounds && meets(solid, placed.bounds_of_triangle(triangle)))) continue;
      Row row{0, instance.id, kNoTriangle, 0, nullptr, &instance, 0, 0, {}, {}};
      if (detail != StaticDetail::kInstances) row.triangle = number;
      if (detail == StaticDetail::kTriangles) row.storage = storage[number];
      rows.push_back(row);
      if (detail == StaticDetail::kInstances) return;
    }
  }

  template <class Solid>
  void answer_overlap(const QueryBlock& block, StaticDetail detail, const Solid& solid, size_t i,
                      BlockResult& result) const {
    Rows rows;
    for (const Instance* instance : instances_)
      if (block.source != Source::kDynamic && instance->id > block.after_id && wanted(block, i, *instance))
        overlap_rows(block, detail, solid, *instance, rows);
    Rows of_objects;
    for (const OracleObject& object : objects_) {
      if (block.source == Source::kStatic || object.id <= block.after_id || !wanted(block, i, object)) continue;
      if (!meets(solid, bounds_of(object.shape))) continue;
      if (block.precision == Precision::kExact && !meets(solid, object.shape)) continue;
      of_objects.push_back({0, object.id, object.part, 0, &object, nullptr, 0, 0, {}, {}});
      if constexpr (!std::is_same_v<Solid, ConvexRegion>)
        of_objects.back().t = static_cast<float>(contact_of(of_objects.back(), block, solid).distance) + 0.0f;
    }
    if (detail == StaticDetail::kInstances) keep_nearest_parts(of_objects);
    for (Row& row : of_objects) {
      row.t = 0;
      rows.push_back(row);
    }
    std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
      return std::tie(a.id, a.storage, a.triangle) < std::tie(b.id, b.storage, b.triangle);
    });
    count(block, rows, i, result);
    for (const Row& row : rows) {
      write(row, block, result);
      if constexpr (!std::is_same_v<Solid, ConvexRegion>) write_contact(row, block, solid, result);
    }
  }

  // Returns the contact of a ball, capsule or box with the row's object or triangle. If the row is a whole instance,
  // returns the contact with the nearest triangle that the solid overlaps. Conservative answers use bounds.
  template <class Solid>
  static Contact contact_of(const Row& row, const QueryBlock& block, const Solid& solid) {
    const Mover mover = resting(solid);
    Contact contact;
    const bool exactly = block.precision == Precision::kExact;
    if (row.object != nullptr && exactly) {
      contact = contact_at(mover, row.object->shape, 0);
    } else if (row.instance != nullptr && exactly) {
      const Transform& transform = row.instance->transform;
      const Mover local = mover_to_mesh(mover, transform);
      const auto mesh_solid = in_mesh(solid, transform);
      const LoosePlacedTriangles loose(*row.instance, reach(solid));
      contact.distance = std::numeric_limits<double>::infinity();
      for (uint32_t number = 0; number < row.instance->mesh->triangle_count(); ++number) {
        const Triangle triangle = row.instance->mesh->triangle(number);
        if (row.triangle != kNoTriangle && row.triangle != number) continue;
        if (!meets(mesh_solid, triangle) || !meets(solid, loose.bounds_of_triangle(triangle))) continue;
        const Contact one = contact_at(local, corners_of(triangle), 0);
        if (one.distance < contact.distance) contact = one;
      }
      contact.distance *= double{transform.scale};
      contact.point = transform.rotation.to_world(contact.point) * double{transform.scale};
      contact.normal = normalized(transform.rotation.to_world(contact.normal));
    } else {
      const Aabbd bounds =
          row.object != nullptr ? bounds_of(row.object->shape)
          : row.triangle == kNoTriangle
              ? row.instance->bounds
              : PlacedTriangles(*row.instance).bounds_of_triangle(row.instance->mesh->triangle(row.triangle));
      const NearestPair pair = nearest_to_box(mover.half_axis, (bounds.min + bounds.max) * 0.5 - mover.start,
                                              (bounds.max - bounds.min) * 0.5);
      contact = {std::is_same_v<Solid, Obbd> ? 0 : std::sqrt(pair.squared_distance), pair.on_primitive, {}};
    }
    return contact;
  }

  template <class Solid>
  static void write_contact(const Row& row, const QueryBlock& block, const Solid& solid, BlockResult& result) {
    const ColumnSet columns = columns_of(block);
    if (!columns.has(Column::kT) && !columns.has(Column::kNormal) && !columns.has(Column::kPoint)) return;
    const Mover mover = resting(solid);
    const Contact contact = contact_of(row, block, solid);
    if (columns.has(Column::kT)) result.t.back() = static_cast<float>(contact.distance) + 0.0f;
    if (columns.has(Column::kNormal)) write_vector(to_float(contact.normal + Vec3d{}), result.normals);
    if (columns.has(Column::kPoint))
      write_vector(to_float(mover.start - block.frame + contact.point + Vec3d{}), result.points);
  }

  void answer_kind(const QueryBlock& block, const BallColumns& balls, BlockResult& result) const {
    for (size_t i = 0; i < balls.centers.size() / 3; ++i) {
      const Balld ball{point(block, balls.centers, i), entry_for(balls.radii, i, 0.0f)};
      answer_overlap(block, balls.detail, ball, i, result);
    }
  }

  void answer_kind(const QueryBlock& block, const BoxColumns& boxes, BlockResult& result) const {
    for (size_t i = 0; i < boxes.centers.size() / 3; ++i) {
      const float* h = &boxes.half_extents[boxes.half_extents.size() == 3 ? 0 : 3 * i];
      Obbd box{point(block, boxes.centers, i), {h[0], h[1], h[2]}, {}};
      if (!boxes.rotations.empty()) {
        const float* q = &boxes.rotations[boxes.rotations.size() == 4 ? 0 : 4 * i];
        box.rotation = rotation_of({q[0], q[1], q[2], q[3]});
      }
      answer_overlap(block, boxes.detail, box, i, result);
    }
  }

  void answer_kind(const QueryBlock& block, const CapsuleColumns& capsules, BlockResult& result) const {
    for (size_t i = 0; i < capsules.starts.size() / 3; ++i) {
      const Vec3d start = point(block, capsules.starts, i);
      const Vec3d end = point(block, capsules.ends, i);
      const Capsule capsule{(start + end) * 0.5, (end - start) * 0.5, entry_for(capsules.radii, i, 0.0f)};
      answer_overlap(block, capsules.detail, capsule, i, result);
    }
  }

  void answer_kind(const QueryBlock& block, const FrustumColumns& frustums, BlockResult& result) const {
    for (size_t i = 0; i < query_count(block); ++i) {
      const auto region = ConvexRegion::make(origin(block, i), FrustumPlanes(frustums, i).planes());
      if (region && !is_unanchored(block, i))
        answer_overlap(block, frustums.detail, *region, i, result);
      else
        result.counts.push_back(0);
    }
  }

  void answer_kind(const QueryBlock& block, const LookupColumns& lookup, BlockResult& result) const {
    const auto rows_of = [&](const auto& wants) {
      Rows rows;
      for (const Instance* instance : instances_)
        if (wants(*instance)) rows.push_back({0, instance->id, kNoTriangle, 0, nullptr, instance, 0, 0, {}, {}});
      for (const OracleObject& object : wholes_)
        if (wants(object)) rows.push_back({0, object.id, kNoTriangle, 0, &object, nullptr, 0, 0, {}, {}});
      std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) { return a.id < b.id; });
      return rows;
    };
    for (const uint64_t id : lookup.ids) {
      Rows rows = rows_of([id](const auto& item) { return item.id == id; });
      rows.resize(1);
      write(rows[0], block, result);
    }
    for (size_t i = 0; i < lookup.groups.size(); ++i) {
      const uint64_t group = lookup.groups[i];
      Rows rows = rows_of([&](const auto& item) { return item.group == group && item.id > block.after_id; });
      count(block, rows, i, result);
      for (const Row& row : rows) write(row, block, result);
    }
  }

  // Returns the squared distance from `point` to a triangle of an instance, and the vector to the nearest point of the
  // triangle. If `conservative` is true, both results refer to the triangle's bounds instead of the triangle.
  static std::pair<double, Vec3d> way_to(Vec3d point, const Instance& instance, const Triangle& triangle,
                                         bool conservative) {
    const Aabbd bounds = PlacedTriangles(instance).bounds_of_triangle(triangle);
    const double least = std::max(squared_distance(point, bounds), squared_distance(point, instance.bounds));
    if (conservative) return {least, nearest_in(point, bounds) - point};
    const Transform& transform = instance.transform;
    const Vec3d a = transform.point_to_world(to_double(triangle.a)),
                b = transform.point_to_world(to_double(triangle.b)),
                c = transform.point_to_world(to_double(triangle.c));
    return {std::max(least, squared_distance(point, a, b, c)),
            nearest_on_triangle({}, a - point, b - point, c - point)};
  }

  static void near_rows(Vec3d point, const Instance& instance, bool every_triangle, bool conservative, Rows& rows) {
    Rows own;
    for (uint32_t number = 0; number < instance.mesh->triangle_count(); ++number) {
      const auto [squared, way] = way_to(point, instance, instance.mesh->triangle(number), conservative);
      own.push_back({entry_of(std::sqrt(squared)), instance.id, number, 0, nullptr, &instance, 0, 0, way, {}});
    }
    const auto nearer = [](const Row& a, const Row& b) {
      return std::tie(a.t, a.triangle) < std::tie(b.t, b.triangle);
    };
    if (!every_triangle && !own.empty()) own = {*std::min_element(own.begin(), own.end(), nearer)};
    rows.insert(rows.end(), own.begin(), own.end());
  }

  // Returns the unit vector from the nearest point of a row to the query's point; `row.normal` is the opposite vector,
  // not normalised. If both points are equal, returns the normal of the triangle's front, or zero for an object. If
  // `conservative` is true, returns zero.
  Vec3d away(const Row& row, bool conservative) const {
    if (conservative) return {};
    if (row.normal != Vec3d{}) return normalized(-row.normal) + Vec3d{};
    if (row.instance == nullptr) return {};
    const Corners corners = corners_of(row.instance->transform, row.instance->mesh->triangle(row.triangle));
    Vec3d front = cross(corners[1] - corners[0], corners[2] - corners[0]);
    if (clockwise_) front = -front;
    return squared_length(front) > 0 ? normalized(front) + Vec3d{} : Vec3d{};
  }

  // Writes the barycentric coordinates (u, v) of the nearest point in its triangle.
  static void write_weights(Vec3d from, const Row& row, bool conservative, BlockResult& result) {
    float u = 0, v = 0;
    if (row.instance != nullptr && !conservative) {
      const Corners corners = corners_of(row.instance->transform, row.instance->mesh->triangle(row.triangle));
      const Vec3d ab = corners[1] - corners[0], ac = corners[2] - corners[0], front = cross(ab, ac);
      const Vec3d along = row.normal - (corners[0] - from);
      if (squared_length(front) > 0) {
        u = static_cast<float>(std::clamp(dot(cross(along, ac), front) / dot(front, front), 0.0, 1.0)) + 0.0f;
        v = static_cast<float>(std::clamp(dot(cross(ab, along), front) / dot(front, front), 0.0, 1.0)) + 0.0f;
      }
    }
    result.uvs.insert(result.uvs.end(), {u, v});
  }

  static void near_row(Vec3d point, const OracleObject& object, bool conservative, Rows& rows) {
    const Aabbd bounds = bounds_of(object.shape);
    const double away = conservative ? std::sqrt(squared_distance(point, bounds)) : distance(point, object.shape);
    Shape around = object.shape;
    around.position = around.position - point;
    const Vec3d way = conservative ? nearest_in(point, bounds) - point : nearest_on_shape({}, around);
    rows.push_back({entry_of(away), object.id, object.part, 0, &object, nullptr, 0, 0, way, {}});
  }

  void answer_kind(const QueryBlock& block, const NearestColumns& nearest, BlockResult& result) const {
    const bool conservative = block.precision == Precision::kConservative;
    const bool every_triangle = nearest.detail != StaticDetail::kInstances;
    for (size_t i = 0; i < nearest.points.size() / 3; ++i) {
      const Vec3d from = point(block, nearest.points, i);
      Rows rows;
      for (const Instance* instance : instances_)
        if (block.source != Source::kDynamic && wanted(block, i, *instance))
          near_rows(from, *instance, every_triangle, conservative, rows);
      Rows near;
      for (const OracleObject& object : objects_)
        if (block.source != Source::kStatic && wanted(block, i, object)) near_row(from, object, conservative, near);
      if (!every_triangle) keep_nearest_parts(near);
      rows.insert(rows.end(), near.begin(), near.end());
      const float farthest = entry_for(nearest.max_distances, i, std::numeric_limits<float>::infinity());
      std::erase_if(rows, [&](const Row& row) { return row.t > farthest; });
      keep_behind(nearest.after, i, rows);
      std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
        return std::tie(a.t, a.id, a.triangle) < std::tie(b.t, b.id, b.triangle);
      });
      if (rows.size() > std::max(1u, nearest.count)) rows.resize(std::max(1u, nearest.count));
      result.counts.push_back(static_cast<uint32_t>(rows.size()));
      for (const Row& row : rows) {
        write(row, block, result);
        if (columns_of(block).has(Column::kPoint))
          write_vector(to_float(from - block.frame + row.normal), result.points);
        if (columns_of(block).has(Column::kNormal)) write_vector(to_float(away(row, conservative)), result.normals);
        if (columns_of(block).has(Column::kUv)) write_weights(from, row, conservative, result);
      }
    }
  }
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_QUERY_ORACLE_H_
