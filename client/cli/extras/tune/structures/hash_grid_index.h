// Values in a hash grid, as an index of the values themselves: HashGrid knows only positions, extents and handles, and
// a program that uses it keeps its values beside it. Built once. Const members may run concurrently.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TUNE_STRUCTURES_HASH_GRID_INDEX_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TUNE_STRUCTURES_HASH_GRID_INDEX_H_

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/index/hash_grid/hash_grid.h"
#include "core/index/spatial_index.h"

namespace locus::cli {

template <Bounded V>
class HashGridIndex {
 public:
  using Value = V;
  using Traits = PrimitiveTraits<V>;

  explicit HashGridIndex(std::vector<V> values) : values_(std::move(values)) {
    std::vector<GridItem> items(values_.size());
    for (uint32_t i = 0; i < items.size(); ++i) {
      const Aabb<typename Traits::Scalar> bounds = Traits::bounds(values_[i]);
      const Vec3d low = to_double(bounds.min), high = to_double(bounds.max);
      items[i].entry.position = low * 0.5 + high * 0.5;
      items[i].entry.id = i + 1;
      items[i].handle = i;
      // Half of the diagonal, rounded up to float.
      items[i].reach = static_cast<float>(std::sqrt(dot(high - low, high - low)) * (0.5 * (1 + 0x1p-22)));
    }
    grid_.apply({{}, {}, items});
    snapshot_ = grid_.snapshot();
  }

  size_t size() const { return values_.size(); }

  template <RayVisitor<V> Visitor>
  void visit_ray(const SlabRay<typename Traits::Scalar>& ray, Visitor& visitor, Work& work) const {
    const SlabRay<double> slabs(Rayd{to_double(ray.origin()), to_double(ray.direction())}, kPad);
    snapshot_.visit_ray(
        slabs, [&visitor] { return static_cast<double>(std::as_const(visitor).limit()); }, work,
        [&](const GridRef& value) { return visitor.visit(values_[value.handle()]); });
  }
  template <RegionVisitor<V> Visitor>
  void visit_region(Visitor& visitor, Work& work) const {
    const Aabb<typename Traits::Scalar> bounds = std::as_const(visitor).bounds();
    snapshot_.visit_region(Aabbd{to_double(bounds.min), to_double(bounds.max)}, work,
                           [&](const GridRef& value) { return visitor.visit(values_[value.handle()]); });
  }
  template <PointVisitor<V> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
    snapshot_.visit_nearest(
        point, [&visitor] { return std::as_const(visitor).limit(); }, work,
        [&](const GridRef& value) { return visitor.visit(values_[value.handle()]); });
  }

 private:
  // Widens the slab test as far as that of the values' own rays.
  static constexpr double kPad = sizeof(typename Traits::Scalar) == sizeof(float) ? kTrianglePad : kObjectPad;

  static Vec3d to_double(const Vec3d& v) { return v; }
  static Vec3d to_double(const Vec3f& v) { return locus::to_double(v); }

  std::vector<V> values_;
  HashGrid grid_;
  GridSnapshot snapshot_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TUNE_STRUCTURES_HASH_GRID_INDEX_H_
