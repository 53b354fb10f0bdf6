// Objects in a hash grid behind the interface of the other indexes, for tests that compare indexes. Every query runs on
// the ObjectSet that readers of a scene use.
#ifndef LOCUS_TESTS_SUPPORT_OBJECT_GRID_H_
#define LOCUS_TESTS_SUPPORT_OBJECT_GRID_H_

#include "core/scene/objects/object_store.h"

namespace locus::test {

class ObjectGrid {
 public:
  using Value = Object;
  using Traits = PrimitiveTraits<Object>;

  ObjectGrid() : ObjectGrid(HashGridOptions()) {}
  explicit ObjectGrid(const HashGridOptions& options) : store_(options), set_(store_.snapshot()) {}

  // Applies a batch and updates the ObjectSet. Returns the result of ObjectStore::apply().
  size_t apply(absl::Span<const Object> removed, absl::Span<const Object> inserted) {
    const size_t replaced = store_.apply(removed, inserted);
    set_ = store_.snapshot();
    return replaced;
  }
  void insert(const Object& object) { apply({}, {&object, 1}); }
  void fix_cell_size(double cell_size) { store_.fix_cell_size(cell_size); }
  double cell_size() const { return set_.grid().cell_size(); }
  bool remove(const Object& object) {
    const bool removed = store_.remove(object);
    set_ = store_.snapshot();
    return removed;
  }

  ObjectSet snapshot() const { return set_; }
  size_t size() const { return set_.size(); }
  bool contains(const Object& object) const { return set_.contains(object); }
  GridStatistics statistics() const { return set_.statistics(); }
  template <class Fn>
  void for_each(Fn&& fn) const {
    set_.for_each(fn);
  }
  template <RayVisitor<Object> Visitor>
  void visit_ray(const SlabRay<double>& ray, Visitor& visitor, Work& work) const {
    set_.visit_ray(ray, visitor, work);
  }
  template <RegionVisitor<Object> Visitor>
  void visit_region(Visitor& visitor, Work& work) const {
    set_.visit_region(visitor, work);
  }
  template <PointVisitor<Object> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
    set_.visit_nearest(point, visitor, work);
  }

 private:
  ObjectStore store_;
  ObjectSet set_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_OBJECT_GRID_H_
