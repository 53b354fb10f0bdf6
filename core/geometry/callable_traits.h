// Traits of values that are made of callables at run time, for types that cannot have a specialisation of
// PrimitiveTraits: types of a script, a type with several sets of traits that are chosen by options, or lambdas in a
// test. A Called<V> is a value with a pointer to its callables, so that any index stores it like another value:
//
//   const ValueCallables<Car> callables = {id_of_car, bounds_of_car, position_of_car};
//   auto tree = KdTree<Called<Car>>::build({{car, &callables}, {other_car, &callables}});
//
// Bounds and distances are in double. Every call goes through a std::function: use PrimitiveTraits where the type is
// known when the program is compiled. Threads: as of the callables. The callables must outlive all values that refer to
// them.
#ifndef LOCUS_CORE_GEOMETRY_CALLABLE_TRAITS_H_
#define LOCUS_CORE_GEOMETRY_CALLABLE_TRAITS_H_

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "core/base/check.h"
#include "core/geometry/primitive_traits.h"
#include "core/geometry/shape.h"

namespace locus {

// Callables with the meanings of the members of PrimitiveTraits. `id`, `bounds` and `position` are needed by every
// index; each of the others only by the queries that test values with it.
template <class V>
struct ValueCallables {
  std::function<uint64_t(const V&)> id;
  std::function<Aabbd(const V&)> bounds;
  std::function<Vec3d(const V&)> position;
  std::function<std::optional<double>(const V&, const ObjectRay&)> ray = {};
  std::function<bool(const V&, const Balld&)> ball = {};
  std::function<bool(const V&, const Obbd&)> box = {};
  std::function<double(const V&, const Vec3d&)> distance = {};
};

// A value with its callables, which are borrowed and never null in an index.
template <class V>
struct Called {
  V value;
  const ValueCallables<V>* callables = nullptr;
};

// Each test also tests the bounds of the value, as primitive_traits.h demands, and distances are moved into the range
// that the bounds allow. So all structures give the same answers, even if the callables do not fit each other.
template <class V>
struct PrimitiveTraits<Called<V>> {
  using Scalar = double;
  using RayQuery = ObjectRay;
  using BallQuery = Balld;
  using BoxQuery = Obbd;

  static uint64_t id(const Called<V>& called) { return call(called, called.callables->id); }
  static Aabbd bounds(const Called<V>& called) { return call(called, called.callables->bounds); }
  static Vec3d position(const Called<V>& called) { return call(called, called.callables->position); }
  static std::optional<double> ray(const Called<V>& called, const ObjectRay& ray) {
    const Interval<double> interval = ray.slabs().interval(bounds(called));
    if (!(interval.near <= interval.far && interval.far >= 0)) return std::nullopt;
    const std::optional<double> t = call(called, called.callables->ray, ray);
    if (!t) return std::nullopt;
    return std::max(std::min(std::max(*t, interval.near), interval.far), 0.0);
  }
  static bool ball(const Called<V>& called, const Balld& ball) {
    return reaches(ball, bounds(called)) && call(called, called.callables->ball, ball);
  }
  static bool box(const Called<V>& called, const Obbd& box) {
    return overlaps(bounds_of(box), bounds(called)) && call(called, called.callables->box, box);
  }
  static double distance(const Called<V>& called, const Vec3d& point) {
    return std::max(call(called, called.callables->distance, point),
                    std::sqrt(squared_distance(point, bounds(called))));
  }

 private:
  template <class Function, class... Arguments>
  static auto call(const Called<V>& called, const Function& function, const Arguments&... arguments) {
    LOCUS_CHECK(function != nullptr);
    return function(called.value, arguments...);
  }
};

}  // namespace locus

#endif  // LOCUS_CORE_GEOMETRY_CALLABLE_TRAITS_H_
