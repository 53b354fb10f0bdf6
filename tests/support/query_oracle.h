// Oracle that answers blocks of queries in the slow and simple way: tests every object and every triangle by the
// predicates of core/geometry, collects the results in one list, sorts the list and truncates it. Shares with
// core/query only the definition of the bounds of placed triangles.
#ifndef LOCUS_TESTS_SUPPORT_QUERY_ORACLE_H_
#define LOCUS_TESTS_SUPPORT_QUERY_ORACLE_H_

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "core/geometry/nearest_pair.h"
#include "core/geometry/sweep.h"
#include "core/geometry/swept_bounds.h"
#include "core/query/frustum_planes.h"
#include "core/query/kinds/placed_triangle.h"
#include "tests/support/oracle_cell.h"
#include "tests/support/oracle_contains.h"
#include "tests/support/oracle_pairs.h"
#include "tests/support/oracle_scene.h"

namespace locus::test {

class QueryOracle : public OracleScene {
 public:
  using OracleScene::OracleScene;

  // Answers a block without a limit on the size of the reply.
  BlockResult answer(const QueryBlock& block) const {
    BlockResult result = block.count_only ? counts_of(block) : rows_of(block);
    for (size_t i = 0; i < block.anchor_ids.size(); ++i)
      if (is_unanchored(block, i)) result.unanchored.push_back(static_cast<uint32_t>(i));
    return result;
  }

 private:
  BlockResult rows_of(const QueryBlock& block) const {
    BlockResult result;
    std::visit([&](const auto& kind) { answer_kind(block, kind, result); }, block.kind);
    return result;
  }
  // Returns only the counts of the rows that there would be without any limit.
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

  struct Question {  // a ray query
    Vec3d origin, direction;
    float t_max;
    Cull cull;
    Inside inside;
    bool conservative;
  };

  void hits_on(const Instance& instance, const Question& question, Rows& rows) const {
    const SlabRay<double> slabs(Rayd{question.origin, question.direction}, kInstancePad);
    const std::optional<float> whole = entry_of(slabs, instance.bounds);
    if (!whole) return;
    const Transform& transform = instance.transform;
    const Cull cull = question.conservative ? Cull::kNone : question.cull;
    const TriangleRay ray(transform, question.origin, question.direction, cull);
    const LoosePlacedTriangles loose(instance);
    for (uint32_t number = 0; number < instance.mesh->triangle_count(); ++number) {
      const Triangle triangle = instance.mesh->triangle(number);
      Row row{kInfinity, instance.id, number, 0, nullptr, &instance, 0, 0, {}, {}};
      const std::optional<float> own = entry_of(slabs, loose.bounds_of_triangle(triangle));
      const std::optional<TriangleHit> hit = ray.hit(triangle);
      if (own && hit) {
        row.t = std::max(std::max(*own, *whole), ray.from_scaled(hit->t));
        row.u = hit->u;
        row.v = hit->v;
        row.normal = normalized(transform.rotation.to_world(area_normal(triangle)));
        if (clockwise_) row.normal = -row.normal;
      }
      if (question.conservative) {
        row.t = std::min(row.t, entry_of_bounds(instance, triangle, question));
        row.u = row.v = 0;
        row.normal = {};
      }
      if (row.t < kInfinity) rows.push_back(row);
    }
  }

  // Returns the t at which the ray enters the bounds of a placed triangle; infinity if it misses the bounds.
  static float entry_of_bounds(const Instance& instance, const Triangle& triangle, const Question& question) {
    const SlabRay<double> slabs(Rayd{question.origin, question.direction}, kObjectPad);
    return entry_of(slabs, PlacedTriangles(instance).bounds_of_triangle(triangle)).value_or(kInfinity);
  }

  void hit_on(const Object& object, const Question& question, Rows& rows) const {
    const ObjectRay ray(Rayd{question.origin, question.direction}, question.inside);
    Row row{0, object.id, kNoTriangle, 0, &object, nullptr, 0, 0, {}, {}};
    if (question.conservative) {
      const std::optional<float> t = entry_of(ray.slabs(), bounds_of(object.shape));
      if (!t) return;
      row.t = *t;
    } else {
      const std::optional<ShapeHit> hit = ray_hit(ray, object.shape);
      if (!hit) return;
      row.t = entry_of(hit->t);
      row.normal = hit->normal;
    }
    rows.push_back(row);
  }

  Question question_of(const QueryBlock& block, const RayColumns& rays, size_t i) const {
    const size_t d = rays.directions.size() == 3 ? 0 : 3 * i;
    Question question{point(block, rays.origins, i),
                      {rays.directions[d], rays.directions[d + 1], rays.directions[d + 2]},
                      entry_for(rays.t_max, i, std::numeric_limits<float>::infinity()),
                      rays.cull,
                      rays.inside,
                      block.precision == Precision::kConservative};
    if (clockwise_ && rays.cull == Cull::kBack) question.cull = Cull::kFront;
    if (clockwise_ && rays.cull == Cull::kFront) question.cull = Cull::kBack;
    return question;
  }

  Rows ray_rows(const QueryBlock& block, const Question& question, size_t i) const {
    Rows rows;
    if (block.source != Source::kDynamic)
      for (const Instance* instance : instances_)
        if (wanted(block, i, *instance)) hits_on(*instance, question, rows);
    if (block.source != Source::kStatic)
      for (const Object& object : objects_)
        if (wanted(block, i, object)) hit_on(object, question, rows);
    std::erase_if(rows, [&](const Row& row) { return row.t > question.t_max; });
    keep_behind(std::get<RayColumns>(block.kind).after, i, rows);
    std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
      return std::tie(a.t, a.id, a.triangle) < std::tie(b.t, b.id, b.triangle);
    });
    return rows;
  }

  void answer_kind(const QueryBlock& block, const RayColumns& rays, BlockResult& result) const {
    for (size_t i = 0; i < rays.origins.size() / 3; ++i) {
      const Question question = question_of(block, rays, i);
      Rows rows = ray_rows(block, question, i);
      if (rays.mode == RayMode::kAny) {
        result.hits.push_back(rows.empty() ? '\0' : '\1');
        continue;
      }
      if (rays.mode == RayMode::kAll) {
        count(block, rows, i, result);
      } else {
        rows.resize(1, Row{std::numeric_limits<float>::infinity(), 0, kNoTriangle, 0, nullptr, nullptr, 0, 0, {}, {}});
      }
      for (const Row& row : rows) {
        write(row, block, result);
        write_surface(row, block, question, result);
      }
    }
  }

  Mover mover_of(const QueryBlock& block, const SweepColumns& sweeps, size_t i) const {
    const auto triple = [i](absl::Span<const float> column) {
      const float* v = &column[column.size() == 3 ? 0 : 3 * i];
      return Vec3d{v[0], v[1], v[2]};
    };
    Mover mover;
    mover.start = point(block, sweeps.starts, i);
    mover.way = triple(sweeps.ends) - triple(sweeps.starts);
    mover.radius = entry_for(sweeps.radii, i, 0.0f);
    if (!sweeps.half_axes.empty()) {
      mover.kind = MoverKind::kCapsule;
      mover.half_axis = triple(sweeps.half_axes);
    } else if (!sweeps.half_extents.empty()) {
      mover.kind = MoverKind::kBox;
      mover.half = triple(sweeps.half_extents);
      if (!sweeps.rotations.empty()) {
        const float* q = &sweeps.rotations[sweeps.rotations.size() == 4 ? 0 : 4 * i];
        mover.rotation = rotation_of({q[0], q[1], q[2], q[3]});
      }
    }
    return mover;
  }

  // Adds the rows of an instance. `normal` and `place` of a row are set from its contact.
  void swept(const QueryBlock& block, const SweepColumns& sweeps, const Mover& mover, const Instance& instance,
             Rows& rows) const {
    const bool by_bounds = block.precision == Precision::kConservative;
    const SweptBounds path(mover, kInstancePad), tight(mover, kObjectPad);
    const std::optional<double> whole = path.entry(instance.bounds);
    if (!whole) return;
    const Mover in_mesh = mover_to_mesh(mover, instance.transform);
    const PlacedTriangles placed(instance);
    const LoosePlacedTriangles loose(instance);
    for (uint32_t number = 0; number < instance.mesh->triangle_count(); ++number) {
      const Triangle triangle = instance.mesh->triangle(number);
      Row row{kInfinity, instance.id, number, 0, nullptr, &instance, 0, 0, {}, {}};
      const std::optional<double> t = first_contact(in_mesh, corners_of(triangle), sweeps.at_start);
      const std::optional<double> own = path.entry(loose.bounds_of_triangle(triangle));
      if (t && own) {
        row.t = entry_of(std::max({*t, *own, *whole}));
        const Contact contact = contact_at(in_mesh, corners_of(triangle), *t);
        row.normal = normalized(instance.transform.rotation.to_world(contact.normal));
        row.place = instance.transform.rotation.to_world(contact.point) * double{instance.transform.scale};
      }
      if (by_bounds) {
        const std::optional<double> entered = tight.entry(placed.bounds_of_triangle(triangle));
        if (entered) row.t = std::min(row.t, entry_of(*entered));
      }
      if (row.t < kInfinity) rows.push_back(row);
    }
  }

  void swept(const QueryBlock& block, const SweepColumns& sweeps, const Mover& mover, const Object& object,
             Rows& rows) const {
    const std::optional<double> entered = SweptBounds(mover, kObjectPad).entry(bounds_of(object.shape));
    if (!entered) return;
    Row row{entry_of(*entered), object.id, kNoTriangle, 0, &object, nullptr, 0, 0, {}, {}};
    if (block.precision == Precision::kExact) {
      const std::optional<double> t = first_contact(mover, object.shape, sweeps.at_start);
      if (!t) return;
      row.t = std::max(row.t, entry_of(*t));
      const Contact contact = contact_at(mover, object.shape, *t);
      row.normal = contact.normal;
      row.place = contact.point;
    }
    rows.push_back(row);
  }

  void answer_kind(const QueryBlock& block, const SweepColumns& sweeps, BlockResult& result) const {
    for (size_t i = 0; i < sweeps.starts.size() / 3; ++i) {
      const Mover mover = mover_of(block, sweeps, i);
      Rows rows;
      for (const Instance* instance : instances_)
        if (block.source != Source::kDynamic && wanted(block, i, *instance))
          swept(block, sweeps, mover, *instance, rows);
      for (const Object& object : objects_)
        if (block.source != Source::kStatic && wanted(block, i, object)) swept(block, sweeps, mover, object, rows);
      std::erase_if(rows, [](const Row& row) { return row.t > 1; });
      std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
        return std::tie(a.t, a.id, a.triangle) < std::tie(b.t, b.id, b.triangle);
      });
      if (sweeps.mode == RayMode::kAny) {
        result.hits.push_back(rows.empty() ? '\0' : '\1');
        continue;
      }
      if (sweeps.mode == RayMode::kAll)
        count(block, rows, i, result);
      else
        rows.resize(1, Row{kInfinity, 0, kNoTriangle, 0, nullptr, nullptr, 0, 0, {}, {}});
      const bool by_bounds = block.precision == Precision::kConservative;
      for (Row& row : rows) {
        if (by_bounds) row.normal = {};
        if (by_bounds && row.id != 0) row.place = mover.way * double{row.t};
        write(row, block, result);
        const ColumnSet columns = columns_of(block);
        if (columns.has(Column::kNormal)) write_vector(to_float(row.normal + Vec3d{}), result.normals);
        if (columns.has(Column::kPoint))
          write_vector(row.id == 0 ? Vec3f{} : to_float(mover.start - block.frame + row.place + Vec3d{}),
                       result.points);
      }
    }
  }

  // Returns whether an instance or object that blocks the viewer's sight of the target meets the segment.
  bool is_blocked(const QueryBlock& block, const SightColumns& sight, size_t viewer, size_t target,
                  const Question& segment) const {
    const Group own = entry_for(sight.viewer_groups, viewer, Group{0});
    const Group other = entry_for(sight.target_groups, target, Group{0});
    const auto blocks = [&](const auto& item) {
      return wanted(block, viewer, item) && (item.group == 0 || (item.group != own && item.group != other));
    };
    Rows rows;
    for (const Instance* instance : instances_)
      if (block.source != Source::kDynamic && blocks(*instance)) hits_on(*instance, segment, rows);
    for (const Object& object : objects_)
      if (block.source != Source::kStatic && blocks(object)) hit_on(object, segment, rows);
    return std::any_of(rows.begin(), rows.end(), [](const Row& row) { return row.t <= 1; });
  }

  char seen_samples(const QueryBlock& block, const SightColumns& sight, size_t viewer, size_t target) const {
    const size_t eyes = sight.eyes_per_viewer(), samples = sight.samples_per_target();
    int seen = 0;
    for (size_t k = 0; k < samples; ++k) {
      bool is_seen = false;
      for (size_t e = 0; e < eyes; ++e) {
        const float* const from = &sight.viewers[3 * (viewer * eyes + e)];
        const float* const to = &sight.targets[3 * (target * samples + k)];
        const Vec3d eye = origin(block, viewer) + Vec3d{from[0], from[1], from[2]};
        const Vec3d way = block.frame + Vec3d{to[0], to[1], to[2]} - eye;
        if (std::sqrt(dot(way, way)) > double{entry_for(sight.max_distances, viewer, kInfinity)}) continue;
        const Question segment{eye, way, 1, Cull::kNone, Inside::kSolid, block.precision == Precision::kConservative};
        is_seen |= way == Vec3d{} || !is_blocked(block, sight, viewer, target, segment);
      }
      seen += is_seen ? 1 : 0;
    }
    return static_cast<char>(seen);
  }

  void answer_kind(const QueryBlock& block, const SightColumns& sight, BlockResult& result) const {
    for (size_t viewer = 0; viewer < sight.viewer_count(); ++viewer) {
      for (size_t target = 0; target < sight.target_count(); ++target) {
        if (sight.pairwise && target != viewer) continue;
        result.matrix.push_back(is_unanchored(block, viewer) ? '\0' : seen_samples(block, sight, viewer, target));
      }
    }
  }

  // Kinds with an oracle in a file of its own.
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

  // Returns whether a solid meets the bounds of an instance; for a capsule, its bounds decide.
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
    for (const Object& object : objects_) {
      if (block.source == Source::kStatic || object.id <= block.after_id || !wanted(block, i, object)) continue;
      if (!meets(solid, bounds_of(object.shape))) continue;
      if (block.precision == Precision::kExact && !meets(solid, object.shape)) continue;
      rows.push_back({0, object.id, kNoTriangle, 0, &object, nullptr, 0, 0, {}, {}});
    }
    std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
      return std::tie(a.id, a.storage, a.triangle) < std::tie(b.id, b.storage, b.triangle);
    });
    count(block, rows, i, result);
    for (const Row& row : rows) {
      write(row, block, result);
      if constexpr (std::is_same_v<Solid, Balld> || std::is_same_v<Solid, Capsule>)
        write_contact(row, block, solid, result);
    }
  }

  // Writes the contact of a ball or capsule with the object or the triangle of a row; for a whole instance, with the
  // nearest triangle that it overlaps.
  template <class Solid>
  static void write_contact(const Row& row, const QueryBlock& block, const Solid& solid, BlockResult& result) {
    const ColumnSet columns = columns_of(block);
    if (!columns.has(Column::kT) && !columns.has(Column::kNormal) && !columns.has(Column::kPoint)) return;
    Hit hit;
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
      contact = {std::sqrt(pair.squared_distance), pair.on_primitive, {}};
    }
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
      for (const Object& object : objects_)
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

  // Returns the unit vector from the nearest point of a row; `row.normal` is the way to it.
  static Vec3d away(const Row& row, bool conservative) {
    if (conservative) return {};
    if (row.normal != Vec3d{}) return normalized(-row.normal) + Vec3d{};
    if (row.instance == nullptr) return {};
    const Corners corners = corners_of(row.instance->transform, row.instance->mesh->triangle(row.triangle));
    const Vec3d front = cross(corners[1] - corners[0], corners[2] - corners[0]);
    return squared_length(front) > 0 ? normalized(front) + Vec3d{} : Vec3d{};
  }

  // Writes the weights of the nearest point in its triangle: parts of the triangle's area.
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

  static void near_row(Vec3d point, const Object& object, bool conservative, Rows& rows) {
    const Aabbd bounds = bounds_of(object.shape);
    const double away = conservative ? std::sqrt(squared_distance(point, bounds)) : distance(point, object.shape);
    Shape around = object.shape;
    around.position = around.position - point;
    const Vec3d way = conservative ? nearest_in(point, bounds) - point : nearest_on_shape({}, around);
    rows.push_back({entry_of(away), object.id, kNoTriangle, 0, &object, nullptr, 0, 0, way, {}});
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
      for (const Object& object : objects_)
        if (block.source != Source::kStatic && wanted(block, i, object)) near_row(from, object, conservative, rows);
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

  static void write_surface(const Row& row, const QueryBlock& block, const Question& question, BlockResult& result) {
    const ColumnSet columns = columns_of(block);
    if (columns.has(Column::kUv)) result.uvs.insert(result.uvs.end(), {row.u, row.v});
    if (columns.has(Column::kNormal)) write_vector(to_float(row.normal), result.normals);
    if (!columns.has(Column::kPoint)) return;
    const Vec3d place = question.origin - block.frame + question.direction * double{row.t};
    write_vector(row.id == 0 ? Vec3f{} : to_float(place), result.points);
  }
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_QUERY_ORACLE_H_
