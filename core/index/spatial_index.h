// Interface of every spatial structure, as concepts. A structure only culls: it passes candidates to a visitor, which
// decides by the exact predicates of the values. Results therefore do not depend on the structure, and the list, which
// culls no value, is the test oracle of the others.
//
// Threads: const members of one index may run concurrently; insert and remove need exclusive use.
#ifndef LOCUS_CORE_INDEX_SPATIAL_INDEX_H_
#define LOCUS_CORE_INDEX_SPATIAL_INDEX_H_

#include <cstddef>
#include <utility>

#include "core/geometry/primitive_traits.h"
#include "core/index/work.h"

namespace locus {

// Visitor of the candidates of a ray. limit(): boxes whose near value exceeds it may be skipped, but not boxes whose
// near value equals it, which may hold a lower id; it may fall during the visit. visit(): false ends the visit. The
// reference passed to visit() is valid only during the call, unless the structure documents a longer lifetime.
template <class Visitor, class Value>
concept RayVisitor = requires(Visitor& visitor, const Value& value) {
  { std::as_const(visitor).limit() } -> std::same_as<ScalarOf<Value>>;
  { visitor.visit(value) } -> std::same_as<bool>;
};

// Visitor of the candidates of a region. overlaps(box): false if no value within the box can be a result; monotone:
// true for every superset of a box for which it is true. bounds(): a box that overlaps the bounds of every result.
template <class Visitor, class Value>
concept RegionVisitor = requires(Visitor& visitor, const Value& value, const Aabb<ScalarOf<Value>>& box) {
  { std::as_const(visitor).bounds() } -> std::same_as<Aabb<ScalarOf<Value>>>;
  { std::as_const(visitor).overlaps(box) } -> std::same_as<bool>;
  { visitor.visit(value) } -> std::same_as<bool>;
};

// Visitor of the candidates around a point. limit(): values whose bounds have a squared_distance() from the point that
// exceeds it may be skipped, but not values at equal distance; it may fall during the visit. visit(): false ends the
// visit.
template <class Visitor, class Value>
concept PointVisitor = requires(Visitor& visitor, const Value& value) {
  { std::as_const(visitor).limit() } -> std::same_as<double>;
  { visitor.visit(value) } -> std::same_as<bool>;
};

namespace internal {
template <class Value>
struct AnyVisitor {  // placeholder for every visitor in the concept below
  ScalarOf<Value> limit() const { return 0; }
  Aabb<ScalarOf<Value>> bounds() const { return {}; }
  bool overlaps(const Aabb<ScalarOf<Value>>&) const { return false; }
  bool visit(const Value&) { return false; }
};
template <class Value>
struct AnyPointVisitor {
  double limit() const { return 0; }
  bool visit(const Value&) { return false; }
};
}  // namespace internal

// Structure that can be queried. visit_ray passes each value exactly once whose bounds have an interval on the ray with
// near <= far, far >= 0 and near <= limit(), roughly from near to far, and may pass further values, each at most once.
// visit_region does the same for values with overlaps(bounds of the value), and visit_nearest for values with
// squared_distance(point, bounds of the value) <= limit(), roughly from near to far.
template <class Index>
concept SpatialIndex = Bounded<typename Index::Value> &&
    requires(const Index& index, const SlabRay<ScalarOf<typename Index::Value>>& slabs,
             internal::AnyVisitor<typename Index::Value>& visitor, Work& work) {
  { index.size() } -> std::same_as<size_t>;
  { index.visit_ray(slabs, visitor, work) } -> std::same_as<void>;
  { index.visit_region(visitor, work) } -> std::same_as<void>;
} && requires(const Index& index, const Vec3d& point, internal::AnyPointVisitor<typename Index::Value>& visitor,
              Work& work) {
  { index.visit_nearest(point, visitor, work) } -> std::same_as<void>;
};

// Structure that can be changed. Precondition of insert(): the id is not in the index. remove() and contains() compare
// ids, but take the value as it was inserted, since a grid finds it by its position.
template <class Index>
concept MutableSpatialIndex = SpatialIndex<Index> &&
    requires(Index& index, const Index& const_index, const typename Index::Value& value) {
  { index.insert(value) } -> std::same_as<void>;
  { index.remove(value) } -> std::same_as<bool>;
  { const_index.contains(value) } -> std::same_as<bool>;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_SPATIAL_INDEX_H_
