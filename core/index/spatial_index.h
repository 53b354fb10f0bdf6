// Interface of every spatial structure, as concepts. A structure only culls: it passes candidates to a visitor, and the
// visitor applies the exact predicates of the values. Results therefore do not depend on the structure, and ListIndex,
// which culls no value, is the test oracle of the other structures (core/index/list/list_index.h).
//
// Threads: const members of one index may run concurrently; insert and remove need exclusive use.
#ifndef LOCUS_CORE_INDEX_SPATIAL_INDEX_H_
#define LOCUS_CORE_INDEX_SPATIAL_INDEX_H_

#include <cstddef>
#include <utility>

#include "core/geometry/primitive_traits.h"
#include "core/index/work.h"

namespace locus {

// Visitor of the candidates of a ray. The near value of a box is the start of the ray's interval in the padded box
// (Interval::near). limit() returns the largest near value of interest, in units of the slab test, and may decrease
// during the visit. A structure may skip a box whose near value exceeds limit(), but not a box whose near value equals
// limit(), since that box may hold a value with a lower id. visit() returns false to end the visit. The reference
// passed to visit() is valid only during the call, unless the structure documents a longer lifetime.
template <class Visitor, class Value, class Traits = PrimitiveTraits<Value>>
concept RayVisitor = requires(Visitor& visitor, const Value& value) {
  { std::as_const(visitor).limit() } -> std::same_as<typename Traits::Scalar>;
  { visitor.visit(value) } -> std::same_as<bool>;
};

// Visitor of the candidates of a region. overlaps(box) returns true for every box that contains a value that can be a
// result; it may also return true for other boxes. overlaps() is monotone: if it returns true for a box, it returns
// true for every superset of that box. bounds() returns a box that overlaps the bounds of every result. visit()
// returns false to end the visit.
template <class Visitor, class Value, class Traits = PrimitiveTraits<Value>>
concept RegionVisitor = requires(Visitor& visitor, const Value& value, const Aabb<typename Traits::Scalar>& box) {
  { std::as_const(visitor).bounds() } -> std::same_as<Aabb<typename Traits::Scalar>>;
  { std::as_const(visitor).overlaps(box) } -> std::same_as<bool>;
  { visitor.visit(value) } -> std::same_as<bool>;
};

// Visitor of the candidates around a point. limit() returns the largest squared distance of interest and may decrease
// during the visit. A structure may skip a value whose bounds have a squared_distance() from the point greater than
// limit(), but not a value whose bounds have a squared distance equal to limit(). visit() returns false to end the
// visit.
template <class Visitor, class Value, class Traits = PrimitiveTraits<Value>>
concept PointVisitor = requires(Visitor& visitor, const Value& value) {
  { std::as_const(visitor).limit() } -> std::same_as<double>;
  { visitor.visit(value) } -> std::same_as<bool>;
};

namespace internal {
template <class Value, std::floating_point S>
struct AnyVisitor {  // visitor type with which the concept SpatialIndex is checked
  S limit() const { return 0; }
  Aabb<S> bounds() const { return {}; }
  bool overlaps(const Aabb<S>&) const { return false; }
  bool visit(const Value&) { return false; }
};
template <class Value>
struct AnyPointVisitor {
  double limit() const { return 0; }
  bool visit(const Value&) { return false; }
};
}  // namespace internal

// Structure that can be queried. A visit passes to the visitor, exactly once each, all values that satisfy the visit's
// condition. It may pass further values, each at most once. Condition of visit_ray(): the bounds of the value have an
// interval on the ray with near <= far, far >= 0 and near <= limit(). Condition of visit_region(): overlaps() accepts
// the bounds. Condition of visit_nearest(): the bounds have a squared_distance() of at most limit() from the point.
// visit_ray() and visit_nearest() pass the values roughly from near to far.
// Traits are the traits by which the index sees its values: PrimitiveTraits<Value>, unless the caller chose others.
template <class Index>
concept SpatialIndex = Bounded<typename Index::Value, typename Index::Traits> &&
    requires(const Index& index, const SlabRay<typename Index::Traits::Scalar>& slabs,
             internal::AnyVisitor<typename Index::Value, typename Index::Traits::Scalar>& visitor, Work& work) {
  { index.size() } -> std::same_as<size_t>;
  { index.visit_ray(slabs, visitor, work) } -> std::same_as<void>;
  { index.visit_region(visitor, work) } -> std::same_as<void>;
} && requires(const Index& index, const Vec3d& point, internal::AnyPointVisitor<typename Index::Value>& visitor,
              Work& work) {
  { index.visit_nearest(point, visitor, work) } -> std::same_as<void>;
};

// Structure that can be changed. Precondition of insert(): no value in the index has the same id. remove() and
// contains() find a value by its id. The caller must nevertheless pass the value with the position at which it was
// inserted, since contains() may compare the position as well.
template <class Index>
concept MutableSpatialIndex = SpatialIndex<Index> &&
    requires(Index& index, const Index& const_index, const typename Index::Value& value) {
  { index.insert(value) } -> std::same_as<void>;
  { index.remove(value) } -> std::same_as<bool>;
  { const_index.contains(value) } -> std::same_as<bool>;
};

}  // namespace locus

#endif  // LOCUS_CORE_INDEX_SPATIAL_INDEX_H_
