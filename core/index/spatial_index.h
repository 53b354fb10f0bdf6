// The interface of every spatial structure, as concepts, and the queries written once for all of them. A structure only
// culls: it hands candidates to a visitor, which decides by the value's own predicates. Verdicts therefore cannot
// depend on the structure, and the list, which culls nothing, is the oracle of all others.
//
// Threads: const members of one index may run concurrently; insert and remove need exclusive use.
#ifndef LOCUS_CORE_INDEX_SPATIAL_INDEX_H_
#define LOCUS_CORE_INDEX_SPATIAL_INDEX_H_

#include <cstddef>
#include <utility>

#include "core/geometry/primitive_traits.h"
#include "core/index/work.h"

namespace locus {

// Takes candidates of a ray. limit(): boxes whose near value exceeds it may be skipped, and only those (not ones that
// equal it: a lower id may wait there); it may fall during the visit. visit(): false ends the visit;
// the value may be gone afterwards, unless the structure promises more.
template <class Visitor, class Value>
concept RayVisitor = requires(Visitor& visitor, const Value& value) {
  { std::as_const(visitor).limit() } -> std::same_as<ScalarOf<Value>>;
  { visitor.visit(value) } -> std::same_as<bool>;
};

// Takes candidates of a region. overlaps(box): false if nothing within the box can be wanted; monotone, so that it
// holds for every superset of a box for which it holds. bounds(): whatever is wanted has bounds that overlap this box.
template <class Visitor, class Value>
concept RegionVisitor = requires(Visitor& visitor, const Value& value, const Aabb<ScalarOf<Value>>& box) {
  { std::as_const(visitor).bounds() } -> std::same_as<Aabb<ScalarOf<Value>>>;
  { std::as_const(visitor).overlaps(box) } -> std::same_as<bool>;
  { visitor.visit(value) } -> std::same_as<bool>;
};

// Takes candidates around a point. limit(): values whose bounds have a greater squared_distance() from it may be
// skipped, and only those (not ones that equal it); it may fall during the visit. visit(): false ends the visit.
template <class Visitor, class Value>
concept PointVisitor = requires(Visitor& visitor, const Value& value) {
  { std::as_const(visitor).limit() } -> std::same_as<double>;
  { visitor.visit(value) } -> std::same_as<bool>;
};

namespace internal {
template <class Value>
struct AnyVisitor {  // stands for every visitor in the concept below
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

// visit_ray hands over, at least once each and at most once each, all values whose own interval satisfies near <= far,
// far >= 0 and near <= limit(); roughly near to far; possibly others. visit_region likewise for overlaps(bounds of
// value), and visit_nearest for squared_distance(point, bounds of value) <= limit(), nearer ones roughly first.
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

// insert() of an id that is in the index is a programmer error; remove() and contains() compare ids and take the value
// as inserted, since a grid finds it by its position.
template <class Index>
concept MutableSpatialIndex = SpatialIndex<Index> &&
    requires(Index& index, const Index& const_index, const typename Index::Value& value) {
  { index.insert(value) } -> std::same_as<void>;
  { index.remove(value) } -> std::same_as<bool>;
  { const_index.contains(value) } -> std::same_as<bool>;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_SPATIAL_INDEX_H_
