// Oracle of rays, sweeps and sight. It works in the slow and simple way that query_oracle.h describes: it tests
// everything, sorts and truncates. Used by tests of queries.
#ifndef LOCUS_TESTS_SUPPORT_ORACLE_RAYS_H_
#define LOCUS_TESTS_SUPPORT_ORACLE_RAYS_H_

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>
#include <vector>

#include "core/geometry/sweep.h"
#include "core/geometry/swept_bounds.h"
#include "core/query/kinds/placed_triangle.h"
#include "tests/support/oracle_scene.h"

namespace locus::test {

class RayOracle : public OracleScene {
 public:
  using OracleScene::OracleScene;

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

  void hit_on(const OracleObject& object, const Question& question, Rows& rows) const {
    const ObjectRay ray(Rayd{question.origin, question.direction}, question.inside);
    Row row{0, object.id, object.part, 0, &object, nullptr, 0, 0, {}, {}};
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
    if (!block.rotation.empty())
      question.direction = rotation_of({block.rotation[0], block.rotation[1], block.rotation[2], block.rotation[3]})
                               .to_world(question.direction);
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
      for (const OracleObject& object : objects_)
        if (wanted(block, i, object)) hit_on(object, question, rows);
    std::erase_if(rows, [&](const Row& row) { return row.t > question.t_max; });
    keep_behind(std::get<RayColumns>(block.kind).after, i, rows);
    std::sort(rows.begin(), rows.end(), [](const Row& a, const Row& b) {
      return std::tie(a.t, a.id, a.triangle) < std::tie(b.t, b.id, b.triangle);
    });
    return rows;
  }

  void answer_kind(const QueryBlock& block, const RayColumns& rays, BlockResult& result) const {
    const size_t origins = rays.origins.size() / 3;
    for (size_t i = 0; i < (origins == 1 ? rays.directions.size() / 3 : origins); ++i) {
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

  // Adds a row for each triangle of the instance that the mover touches, and in conservative answers also for each
  // triangle whose bounds it touches. `normal` and `place` of a row are set from the contact with the triangle.
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

  void swept(const QueryBlock& block, const SweepColumns& sweeps, const Mover& mover, const OracleObject& object,
             Rows& rows) const {
    const std::optional<double> entered = SweptBounds(mover, kObjectPad).entry(bounds_of(object.shape));
    if (!entered) return;
    Row row{entry_of(*entered), object.id, object.part, 0, &object, nullptr, 0, 0, {}, {}};
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
      for (const OracleObject& object : objects_)
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

  // Returns whether the segment hits an instance or object that can block the viewer's sight of the target.
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
    for (const OracleObject& object : objects_)
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

#endif  // LOCUS_TESTS_SUPPORT_ORACLE_RAYS_H_
