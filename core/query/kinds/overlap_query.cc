#include "core/query/kinds/overlap_query.h"

#include <limits>
#include <optional>
#include <type_traits>

#include "core/base/check.h"
#include "core/base/planted_bug.h"
#include "core/geometry/segment.h"
#include "core/geometry/sweep.h"
#include "core/index/regions.h"
#include "core/query/kinds/object_bounds.h"
#include "core/query/kinds/object_parts.h"
#include "core/query/kinds/overlap_contact.h"
#include "core/query/kinds/placed_triangle.h"
#include "core/query/kinds/triangle_search.h"

namespace locus {
namespace {

// Operations on a ball, in world axes and in the mesh axes of an instance, for the templates below.
// is_region_of_search() returns whether the region in which search_region() searches the grid for an EXACT query is the
// shape itself, so that an object overlaps the shape if its position is inside that region.
struct BallShape {
  static constexpr bool kHasKernels = true;
  using World = Balld;
  using Mesh = Ballf;
  using WorldRegion = BallRegion<double>;
  using MeshRegion = BallRegion<float>;

  static Ballf to_mesh(const Balld& ball, const Instance& instance) {
    const Transform& transform = instance.transform;
    return {to_float(transform.point_to_mesh(ball.center)), static_cast<float>(ball.radius / transform.scale)};
  }
  static double size(const Ballf& ball) { return ball.radius; }
  static double extent(const Balld& ball) { return max_component(abs(ball.center)) + ball.radius; }
  static std::optional<Balld> as_ball(const Balld& ball) { return ball; }
  static bool overlaps_bounds(const Balld& ball, const Aabbd& bounds) { return reaches(ball, bounds); }
  static bool overlaps_object(const Balld& ball, const Shape& shape) { return ball_overlaps(ball, shape); }
  static bool is_region_of_search(const Balld&) { return true; }
  static Verdict verdict(const Balld& ball, const ObjectBounds& object) {
    const double squared = squared_length(object.position - ball.center);
    const double far = ball.radius + object.extent + object.displacement_bound;
    const double near = ball.radius + object.inner_radius - object.displacement_bound;
    if (squared > far * far) return Verdict::kDisjoint;
    return near > 0 && squared < near * near ? Verdict::kOverlaps : Verdict::kUndecided;
  }
  static bool overlaps_triangle(const Ballf& ball, const Triangle& triangle) { return ball_overlaps(ball, triangle); }
};

// Operations on a box, with the same members as BallShape.
struct BoxShape {
  static constexpr bool kHasKernels = true;
  using World = Obbd;
  using Mesh = Obbf;
  using WorldRegion = BoxRegion<double>;
  using MeshRegion = BoxRegion<float>;

  static Obbf to_mesh(const Obbd& box, const Instance& instance) {
    const Transform& transform = instance.transform;
    return {to_float(transform.point_to_mesh(box.center)), to_float(box.half * (1.0 / transform.scale)),
            compose(inverse(transform.rotation), box.rotation)};
  }
  static double size(const Obbf& box) { return max_component(box.half); }
  static double extent(const Obbd& box) { return max_component(abs(box.center)) + max_component(box.half) * 2; }
  static std::optional<Balld> as_ball(const Obbd&) { return std::nullopt; }
  static bool overlaps_bounds(const Obbd& box, const Aabbd& bounds) { return overlaps(bounds_of(box), bounds); }
  static bool overlaps_object(const Obbd& box, const Shape& shape) { return box_overlaps(box, shape); }
  static bool is_region_of_search(const Obbd& box) { return box.rotation == Rotation(); }
  static Verdict verdict(const Obbd& box, const ObjectBounds& object) {
    // Largest signed distance of the object's position from a side plane of the box; negative inside the box.
    const double outside = max_component(abs(box.rotation.to_local(object.position - box.center)) - box.half);
    if (outside > object.extent + object.displacement_bound) return Verdict::kDisjoint;
    return outside < -object.displacement_bound ? Verdict::kOverlaps : Verdict::kUndecided;
  }
  static bool overlaps_triangle(const Obbf& box, const Triangle& triangle) { return box_overlaps(box, triangle); }
};

// Operations on a capsule, with the members of BallShape except size(), which only kernels need. A capsule stays in
// double in mesh axes.
struct CapsuleShape {
  static constexpr bool kHasKernels = false;
  using World = Capsule;
  using Mesh = Capsule;
  using WorldRegion = BoxRegion<double>;
  using MeshRegion = CapsuleRegion;

  static Capsule to_mesh(const Capsule& capsule, const Instance& instance) {
    const Transform& transform = instance.transform;
    const double inverse_scale = 1.0 / transform.scale;
    return {transform.point_to_mesh(capsule.center), transform.rotation.to_local(capsule.half_axis) * inverse_scale,
            capsule.radius * inverse_scale};
  }
  static double extent(const Capsule& capsule) {
    return max_component(abs(capsule.center)) + max_component(abs(capsule.half_axis)) + capsule.radius;
  }
  static std::optional<Balld> as_ball(const Capsule&) { return std::nullopt; }
  static bool overlaps_bounds(const Capsule& capsule, const Aabbd& bounds) { return reaches(capsule, bounds); }
  static bool overlaps_object(const Capsule& capsule, const Shape& shape) { return capsule_overlaps(capsule, shape); }
  static bool is_region_of_search(const Capsule&) { return false; }
  static Verdict verdict(const Capsule& capsule, const ObjectBounds& object) {
    const double squared = squared_distance_to_segment(object.position - capsule.center, capsule.half_axis);
    const double epsilon = internal::kBoundsGrowth * extent(capsule);
    const double far = capsule.radius + object.extent + object.displacement_bound + epsilon;
    const double near = capsule.radius + object.inner_radius - object.displacement_bound - epsilon;
    if (squared > far * far) return Verdict::kDisjoint;
    return near > 0 && squared < near * near ? Verdict::kOverlaps : Verdict::kUndecided;
  }
  static bool overlaps_triangle(const Capsule& capsule, const Triangle& triangle) {
    return capsule_overlaps(capsule, triangle);
  }
};

// Culling tests of a convex region in world axes, and in the axes of a mesh.
class ConvexWorldRegion {
 public:
  explicit ConvexWorldRegion(const ConvexRegion& region) : region_(region) {}
  Aabbd bounds() const { return region_.bounds(); }
  bool overlaps(const Aabbd& box) const { return may_overlap(region_, box); }

 private:
  const ConvexRegion& region_;
};
class ConvexMeshRegion {
 public:
  explicit ConvexMeshRegion(const RegionInMesh& region) : region_(region) {}
  static Aabbf bounds() {
    constexpr float kInfinity = Aabbf::kInfinity;
    return {{-kInfinity, -kInfinity, -kInfinity}, {kInfinity, kInfinity, kInfinity}};
  }
  bool overlaps(const Aabbf& box) const { return region_.may_overlap(box); }

 private:
  const RegionInMesh& region_;
};

// Operations on a convex region, with the members of BallShape except size().
struct RegionShape {
  static constexpr bool kHasKernels = false;
  using World = ConvexRegion;
  using Mesh = RegionInMesh;
  using WorldRegion = ConvexWorldRegion;
  using MeshRegion = ConvexMeshRegion;

  static Mesh to_mesh(const ConvexRegion& region, const Instance& instance) {
    return Mesh(region, instance.transform, magnitude(instance.mesh->bounds()));
  }
  static double extent(const ConvexRegion& region) { return max_component(abs(region.origin())); }
  static std::optional<Balld> as_ball(const ConvexRegion&) { return std::nullopt; }
  static bool overlaps_bounds(const ConvexRegion& region, const Aabbd& bounds) { return may_overlap(region, bounds); }
  static bool overlaps_object(const ConvexRegion& region, const Shape& shape) { return region_overlaps(region, shape); }
  static bool is_region_of_search(const ConvexRegion&) { return false; }
  static Verdict verdict(const ConvexRegion& region, const ObjectBounds& object) {
    return verdict_of(side_of_ball(region, object.position, object.extent, object.displacement_bound));
  }
  // Returns the verdict for an object of a brick of the grid, for which near_planes() returned `planes`.
  static Verdict verdict(const ConvexRegion& region, const NearPlanes& near, const ObjectBounds& object) {
    if (near.outside) return Verdict::kDisjoint;
    return verdict_of(side_of_ball(region, near.planes, object.position, object.extent, object.displacement_bound));
  }
  // Returns the planes that the objects of a brick of the grid must be compared with.
  static NearPlanes planes_near(const ConvexRegion& region, const GridBrickBounds& brick) {
    const double epsilon = internal::kBoundsGrowth * (magnitude(brick.positions) + brick.max_extent);
    return near_planes(region, brick.positions, brick.max_extent, epsilon);
  }
  static Verdict verdict_of(RegionSide side) {
    switch (side) {
      case RegionSide::kInside:
        return Verdict::kOverlaps;
      case RegionSide::kOutside:
        return Verdict::kDisjoint;
      case RegionSide::kUndecided:
        break;
    }
    return Verdict::kUndecided;
  }
  static bool overlaps_triangle(const Mesh& region, const Triangle& triangle) { return region.overlaps(triangle); }
};

// Returns the region of the grid in which to search for objects.
template <class Kind>
GridRegion search_region(const SceneAtTime& moment, const typename Kind::World& shape, const OverlapOptions& options) {
  const typename Kind::WorldRegion region(shape);
  // Only an EXACT ball query can restrict the search to the ball. A CONSERVATIVE ball query also finds an object if
  // the ball overlaps only the bounds of the object. Queries of other shapes search the axis-aligned bounds of the
  // shape.
  const bool exact = options.precision == Precision::kExact;
  GridRegion search = moment.region(region.bounds(), exact ? Kind::as_ball(shape) : std::nullopt);
  // Between two ticks, the marks would be those of positions in the widened region.
  if (exact && !moment.between() && Kind::is_region_of_search(shape)) search.marks = Marks::kInside;
  return search;
}

// Selects whether the rows of compounds name a part.
enum class NameParts : uint8_t { kNo, kYes };

// Visitor of the moving objects that one ball, box, capsule or convex region may overlap. Adds the rows of compounds to
// a LowestRows, because they name parts, and the other objects to QueryTask::found_objects().
template <class Kind>
class ObjectRows {
 public:
  ObjectRows(QueryTask& task, const SceneAtTime& moment, const typename Kind::World& shape,
             const OverlapOptions& options, const Filter& filter, NameParts name_parts, LowestRows& rows)
      : task_(task),
        moment_(moment),
        shape_(shape),
        options_(options),
        filter_(filter),
        name_parts_(name_parts),
        rows_(rows),
        found_(task.found_objects()) {
    found_.restart(options.max_results, options.count_only);
  }

  Aabbd bounds() const { return typename Kind::WorldRegion(shape_).bounds(); }
  GridRegion region() const { return search_region<Kind>(moment_, shape_, options_); }
  bool visit(const GridRef& object) {
    if (!task_.count_test()) return false;
    if (object.entry().id <= options_.after_id || !filter_.accepts(object.entry())) return true;
    if (has_parts(object)) return visit_parts(object);
    if (overlaps(object)) found_.offer(object);
    return true;
  }

 private:
  // Adds the rows of a compound: one for each part that the query overlaps, or one for the nearest of these parts.
  bool visit_parts(const GridRef& object) {
    const bool exact = options_.precision == Precision::kExact;
    if (exact && verdict_by_bounds(object) == Verdict::kDisjoint) return true;
    const bool one_row = options_.detail == StaticDetail::kInstances;
    // The order of the parts needs no distance if all rows are returned, and regions have no distances.
    const bool first_only = one_row && (name_parts_ == NameParts::kNo || options_.count_only == CountOnly::kYes ||
                                        std::is_same_v<Kind, RegionShape>);
    absl::InlinedVector<uint32_t, limits::kMaxParts> parts;
    for_each_part(moment_, object, filter_.layers(), [&](const PlacedCompound::PlacedPart& part) {
      if (!Kind::overlaps_bounds(shape_, part.loose_bounds())) return true;
      ++task_.work().tests;
      if (!task_.count_test()) return false;
      const Shape shape = part.shape();
      const bool found = exact ? Kind::overlaps_object(shape_, shape) : Kind::overlaps_bounds(shape_, bounds_of(shape));
      if (found) parts.push_back(part.number());
      return !(found && first_only);
    });
    if (parts.empty()) return !task_.ended();
    if constexpr (!std::is_same_v<Kind, RegionShape>) {
      if (one_row && parts.size() > 1)
        parts = {nearest_part(resting(shape_), options_.precision, hit_on(object, 0, moment_), parts)};
    }
    if (name_parts_ == NameParts::kYes)
      rows_.offer(hit_on(object, 0, moment_), parts);
    else
      rows_.offer(hit_on(object, 0, moment_));
    return !task_.ended();
  }
  // Returns the verdict for an object by its stored position and bounds. A convex region may contain many bricks, so
  // the planes near a brick are determined first, once for consecutive objects of the brick. Between two ticks, objects
  // may lie outside of their brick. A search by brute force must not depend on bricks.
  Verdict verdict_by_bounds(const GridRef& object) {
    const ObjectBounds bounds = object_bounds(object, moment_.displacement_bound(object));
    if constexpr (std::is_same_v<Kind, RegionShape>) {
      if (moment_.between() || !task_.uses_kernels()) return Kind::verdict(shape_, bounds);
      if (object.brick() != brick_) {
        brick_ = object.brick();
        near_planes_ = Kind::planes_near(shape_, moment_.objects().grid().brick_bounds(brick_));
      }
      return Kind::verdict(shape_, near_planes_, bounds);
    } else {
      return Kind::verdict(shape_, bounds);
    }
  }
  bool overlaps(const GridRef& object) {
    if (object.is_inside()) return true;  // see search_region()
    const bool exact = options_.precision == Precision::kExact;
    if (exact) {  // avoids computing the shape of most objects at the time of the query
      const Verdict verdict = verdict_by_bounds(object);
      if (verdict != Verdict::kUndecided) return verdict == Verdict::kOverlaps;
    }
    const Shape shape = moment_.shape(object);
    return exact ? Kind::overlaps_object(shape_, shape) : Kind::overlaps_bounds(shape_, bounds_of(shape));
  }

  QueryTask& task_;
  const SceneAtTime& moment_;
  const typename Kind::World& shape_;
  const OverlapOptions& options_;
  const Filter& filter_;
  const NameParts name_parts_;
  LowestRows& rows_;
  FoundObjects& found_;
  // Brick of the last object, and the planes near it. Only used for convex regions.
  uint32_t brick_ = std::numeric_limits<uint32_t>::max();
  NearPlanes near_planes_;
};

// Adapter that adds the rows of one instance to a LowestRows: one row, or one row per triangle found. Triangles must be
// offered in storage order.
class OverlapRows {
 public:
  OverlapRows(const Instance& instance, const OverlapOptions& options, LowestRows& rows)
      : instance_(instance),
        detail_(options.detail),
        count_only_(options.count_only),
        max_results_(options.max_results),
        rows_(rows) {}

  // Offers triangles that overlap the query. Returns false if the search of this instance can stop, because later
  // triangles would add no rows.
  bool offer(absl::Span<const uint32_t> triangles) {
    if (detail_ == StaticDetail::kInstances) {
      if (!triangles.empty()) rows_.offer(hit_on(instance_, 0));
      return triangles.empty();
    }
    rows_.offer(hit_on(instance_, 0), triangles);
    found_ += triangles.size();
    return detail_ != StaticDetail::kTriangles || found_ <= max_results_ || count_only_ == CountOnly::kYes;
  }

  bool offer(const Triangle& triangle) { return offer({&triangle.number, 1}); }

 private:
  const Instance& instance_;
  const StaticDetail detail_;
  const CountOnly count_only_;
  const uint32_t max_results_;
  LowestRows& rows_;
  size_t found_ = 0;
};

// Exact test of one solid against single triangles of one instance.
template <class Kind>
class ExactOverlapTest {
 public:
  ExactOverlapTest(const typename Kind::World& world_shape, const Instance& instance)
      : shape_(Kind::to_mesh(world_shape, instance)),
        world_shape_(world_shape),
        placed_(instance, Kind::extent(world_shape)) {}

  const typename Kind::Mesh& mesh_shape() const { return shape_; }
  const LoosePlacedTriangles& placed() const { return placed_; }
  bool overlaps(const Triangle& triangle) const {
    return Kind::overlaps_triangle(shape_, triangle) &&
           Kind::overlaps_bounds(world_shape_, placed_.bounds_of_triangle(triangle));
  }

 private:
  const typename Kind::Mesh shape_;
  const typename Kind::World& world_shape_;
  const LoosePlacedTriangles placed_;
};

// Visitor of the triangles of one instance for EXACT queries that do not use the kernels.
template <class Kind>
class ExactTriangles {
 public:
  ExactTriangles(QueryTask& task, const ExactOverlapTest<Kind>& exact, OverlapRows rows)
      : task_(task), region_(exact.mesh_shape()), exact_(exact), rows_(rows) {}

  Aabbf bounds() const { return region_.bounds(); }
  bool overlaps(const Aabbf& box) const { return region_.overlaps(box); }
  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    return !exact_.overlaps(triangle) || rows_.offer(triangle);
  }

 private:
  QueryTask& task_;
  const typename Kind::MeshRegion region_;
  const ExactOverlapTest<Kind>& exact_;
  OverlapRows rows_;
};

// Visitor of the triangles of one instance for CONSERVATIVE queries: tests the bounds of each triangle in world axes.
// Because the exact test rounds to floats in mesh axes, the exact test may find a triangle whose bounds the shape
// misses. Such a triangle is reported as well, so that a CONSERVATIVE result contains every EXACT row.
template <class Kind>
class PlacedBounds {
 public:
  PlacedBounds(QueryTask& task, const typename Kind::World& shape, const Instance& instance, OverlapRows rows)
      : task_(task),
        shape_(shape),
        region_(shape),
        mesh_(*instance.mesh),
        placed_(instance),
        exact_(shape, instance),
        mesh_region_(exact_.mesh_shape()),
        rows_(rows) {}

  Aabbf bounds() const { return mesh_.bounds(); }
  bool overlaps(const Aabbf& box) const {
    return region_.overlaps(placed_.bounds_of_box(box)) || mesh_region_.overlaps(box);
  }
  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    const bool found = Kind::overlaps_bounds(shape_, placed_.bounds_of_triangle(triangle)) ||
                       (exact_.overlaps(triangle) && !planted(PlantedBug::kPlacedBoundsAlone));
    return !found || rows_.offer(triangle);
  }

 private:
  QueryTask& task_;
  const typename Kind::World& shape_;
  const typename Kind::WorldRegion region_;
  const StaticMesh& mesh_;
  const PlacedTriangles placed_;
  const ExactOverlapTest<Kind> exact_;
  const typename Kind::MeshRegion mesh_region_;
  OverlapRows rows_;
};

// Visitor of the instances that one ball, box, capsule or convex region may overlap.
template <class Kind>
class InstanceSearch {
 public:
  InstanceSearch(QueryTask& task, const typename Kind::World& shape, const OverlapOptions& options,
                 const Filter& filter, LowestRows& rows)
      : task_(task), shape_(shape), region_(shape), options_(options), filter_(filter), rows_(rows) {}

  Aabbd bounds() const { return region_.bounds(); }
  bool overlaps(const Aabbd& box) const { return region_.overlaps(box); }
  bool visit(const Instance& instance) {
    if (!task_.count_test()) return false;
    if (instance.id <= options_.after_id || !filter_.accepts(instance)) return true;
    // A shape overlaps an instance only if the shape overlaps the instance's bounds. This test is repeated here because
    // the tree over instances may or may not cull by these bounds, and the result must not depend on culling.
    if (!region_.overlaps(instance.bounds)) return true;
    OverlapRows rows(instance, options_, rows_);
    if (options_.precision == Precision::kConservative) {
      PlacedBounds<Kind> visitor(task_, shape_, instance, rows);
      task_.visit_region(instance.mesh->tree(), visitor);
    } else {
      visit_exactly(instance, rows);
    }
    return !task_.ended();
  }

 private:
  void visit_exactly(const Instance& instance, OverlapRows& rows) {
    const TriangleBvh& tree = instance.mesh->tree();
    const ExactOverlapTest<Kind> exact(shape_, instance);
    if constexpr (Kind::kHasKernels) {
      const typename Kind::Mesh& shape = exact.mesh_shape();
      if (task_.uses_kernels() && TriangleSearch<typename Kind::Mesh>::served(tree, shape) &&
          exact.placed().bounds_follow(to_double(shape.center), Kind::size(shape)))
        return search(tree, shape, rows);
    }
    ExactTriangles<Kind> visitor(task_, exact, rows);
    task_.visit_region(tree, visitor);
  }

  void search(const TriangleBvh& tree, const typename Kind::Mesh& shape, OverlapRows& rows) {
    TriangleSearch<typename Kind::Mesh> search(tree, shape);
    uint32_t triangles[kTrianglesPerStep];
    const size_t room = options_.detail == StaticDetail::kInstances ? kMinRegionRoom : kTrianglesPerStep;
    bool more = true;
    while (more && !search.over()) {
      const size_t found = search.next(triangles, room);
      task_.work().nodes += search.nodes();
      task_.work().tests += search.tests();
      more = rows.offer({triangles, found});
      // Counts `found` as well, because triangles of subtrees inside the region are found without a test. Otherwise
      // RunOptions::stop might not be called often enough.
      more = task_.count_tests(search.tests() + found) && more;
    }
  }

  static constexpr size_t kTrianglesPerStep = 2048;

  QueryTask& task_;
  const typename Kind::World& shape_;
  typename Kind::WorldRegion region_;
  const OverlapOptions& options_;
  const Filter& filter_;
  LowestRows& rows_;
};

// Visitor of the triangles of one instance. Retains the nearest triangle that the solid overlaps.
template <class Kind>
class NearestOverlapping {
 public:
  NearestOverlapping(QueryTask& task, const ExactOverlapTest<Kind>& exact, const Mover& mover)
      : task_(task), region_(exact.mesh_shape()), exact_(exact), mover_(mover) {}

  Aabbf bounds() const { return region_.bounds(); }
  bool overlaps(const Aabbf& box) const { return region_.overlaps(box); }
  bool visit(const Triangle& triangle) {
    if (!task_.count_test()) return false;
    if (!exact_.overlaps(triangle)) return true;
    const double distance = contact_at(mover_, corners_of(triangle), 0).distance;
    if (distance > least_ || (distance == least_ && triangle.number > nearest_)) return true;
    least_ = distance;
    nearest_ = triangle.number;
    return true;
  }
  uint32_t nearest() const { return nearest_; }

 private:
  QueryTask& task_;
  const typename Kind::MeshRegion region_;
  const ExactOverlapTest<Kind>& exact_;
  const Mover& mover_;
  double least_ = std::numeric_limits<double>::infinity();
  uint32_t nearest_ = kNoTriangle;
};

template <class Kind>
uint32_t search_nearest(QueryTask& task, const typename Kind::World& solid, const Instance& instance) {
  const ExactOverlapTest<Kind> exact(solid, instance);
  const Mover mover = mover_to_mesh(resting(solid), instance.transform);
  NearestOverlapping<Kind> visitor(task, exact, mover);
  task.visit_region(instance.mesh->tree(), visitor);
  return visitor.nearest();
}

template <class Kind>
OverlapAnswer run_overlap(QueryTask& task, const SceneAtTime& moment, const typename Kind::World& shape,
                          const OverlapOptions& options, const Filter& filter) {
  LOCUS_DCHECK_GE(options.max_results, 1u);
  LowestRows rows(options.max_results, options.detail == StaticDetail::kTrianglesSorted, options.count_only);
  if (options.source != Source::kDynamic) {
    InstanceSearch<Kind> search(task, shape, options, filter, rows);
    task.visit_region(moment.statics().tree(), search);
  }
  const bool may_find_objects = options.source != Source::kStatic && moment.objects().size() != 0 && !task.ended();
  if (may_find_objects) {
    ObjectRows<Kind> search(task, moment, shape, options, filter, NameParts::kYes, rows);
    task.visit_objects_in_region(moment, search);
  }
  OverlapAnswer answer = rows.finish();
  if (may_find_objects) add_objects(answer, task.found_objects(), moment, options);
  return answer;
}

}  // namespace

void find_objects_around(QueryTask& task, const SceneAtTime& moment, const Balld& point, const OverlapOptions& options,
                         const Filter& filter, LowestRows& rows) {
  ObjectRows<BallShape> search(task, moment, point, options, filter, NameParts::kNo, rows);
  task.visit_objects_in_region(moment, search);
}

uint32_t nearest_overlapping(QueryTask& task, const Balld& solid, const Instance& instance) {
  return search_nearest<BallShape>(task, solid, instance);
}

uint32_t nearest_overlapping(QueryTask& task, const Capsule& solid, const Instance& instance) {
  return search_nearest<CapsuleShape>(task, solid, instance);
}

uint32_t nearest_overlapping(QueryTask& task, const Obbd& solid, const Instance& instance) {
  return search_nearest<BoxShape>(task, solid, instance);
}

OverlapAnswer run_ball(QueryTask& task, const SceneAtTime& moment, const Balld& ball, const OverlapOptions& options,
                       const Filter& filter) {
  return run_overlap<BallShape>(task, moment, ball, options, filter);
}

OverlapAnswer run_box(QueryTask& task, const SceneAtTime& moment, const Obbd& box, const OverlapOptions& options,
                      const Filter& filter) {
  return run_overlap<BoxShape>(task, moment, box, options, filter);
}

OverlapAnswer run_capsule(QueryTask& task, const SceneAtTime& moment, const Capsule& capsule,
                          const OverlapOptions& options, const Filter& filter) {
  return run_overlap<CapsuleShape>(task, moment, capsule, options, filter);
}

OverlapAnswer run_region(QueryTask& task, const SceneAtTime& moment, const ConvexRegion& region,
                         const OverlapOptions& options, const Filter& filter) {
  return run_overlap<RegionShape>(task, moment, region, options, filter);
}

GridRegion ball_region(const SceneAtTime& moment, const Balld& ball, const OverlapOptions& options) {
  return search_region<BallShape>(moment, ball, options);
}

GridRegion box_region(const SceneAtTime& moment, const Obbd& box, const OverlapOptions& options) {
  return search_region<BoxShape>(moment, box, options);
}

GridRegion capsule_region(const SceneAtTime& moment, const Capsule& capsule, const OverlapOptions& options) {
  return search_region<CapsuleShape>(moment, capsule, options);
}

}  // namespace locus
