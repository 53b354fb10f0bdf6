// The moving objects of a scene at one revision, indexed by id and by a grid. Immutable and safe to read from any
// thread; shares unchanged memory with other revisions. ObjectSet satisfies the concept SpatialIndex
// (core/index/spatial_index.h).
#ifndef LOCUS_CORE_SCENE_OBJECTS_OBJECT_SET_H_
#define LOCUS_CORE_SCENE_OBJECTS_OBJECT_SET_H_

#include <memory>
#include <optional>
#include <utility>

#include "core/base/persistent_id_table.h"
#include "core/index/hash_grid/grid_snapshot.h"
#include "core/index/spatial_index.h"
#include "core/scene/objects/compound_table.h"
#include "core/scene/objects/group_lists.h"
#include "core/scene/objects/object.h"

namespace locus {

// Return the shape, or the complete object, to which a reference into the grid points.
Shape shape_of(const GridRef& value);
Object object_of(const GridRef& value);
// Returns the compound of an object, or null if the object is of another kind. The object's set or store owns it.
const Compound* compound_of(const GridRef& value);
// Returns the bounds of an object whose shape, at the time in question, is `shape`: of a compound, the union of the
// bounds of its parts.
Aabbd bounds_of(const GridRef& value, const Shape& shape);
// Returns the grid item that stores `object` under `handle`.
GridItem grid_item_of(const Object& object, uint32_t handle);

class ObjectSet {
 public:
  using Value = Object;
  using Traits = PrimitiveTraits<Object>;

  ObjectSet() = default;
  // `groups` may be null if no object belongs to a group, and `compounds` if no object is a compound.
  ObjectSet(GridSnapshot grid, PersistentIdTable<> handles, std::shared_ptr<const GroupLists> groups,
            std::shared_ptr<const CompoundArray> compounds)
      : grid_(std::move(grid)),
        handles_(std::move(handles)),
        groups_(std::move(groups)),
        compounds_(std::move(compounds)) {}

  size_t size() const { return grid_.size(); }
  const GridSnapshot& grid() const { return grid_; }
  // Returns a reference to the object with this id, or a null reference if no object has the id. O(1), plus a search
  // through the handles of one brick.
  GridRef find_ref(Id id) const;
  std::optional<Object> find(Id id) const;
  // Returns true if an object with the id of `object` is stored at exactly the position of `object`.
  bool contains(const Object& object) const {
    const GridRef known = find_ref(object.id);
    return known && known.entry().position == object.shape.position;
  }

  // Returns the number of objects that belong to `group`, which is not 0. O(1).
  size_t count_in(Group group) const { return groups_ == nullptr ? 0 : groups_->count(group); }
  // Calls visit(GridRef) for each object of `group`, until visit() returns false. Returns false if it did. Cost: for
  // each object of the group, a search through the handles of one brick.
  template <class Visit>
  bool for_each_in(Group group, const Visit& visit) const {
    return groups_ == nullptr || groups_->for_each(group, [&](uint32_t handle) { return visit(grid_.at(handle)); });
  }

  // Calls fn(object) for each object, in an order that depends only on the sequence of changes of the grid. O(size).
  template <class Fn>
  void for_each(Fn&& fn) const {
    grid_.for_each([&fn](const GridRef& value) {
      fn(object_of(value));
      return true;
    });
  }

  // Calls fn(object) for the objects from `cursor` on, until fn returns false. Advances `cursor`, so that a later call
  // continues after the last object that was passed to fn.
  template <class Fn>
  void for_each_from(GridCursor& cursor, const Fn& fn) const {
    grid_.for_each_from(cursor, [&fn](const GridRef& value) { return fn(object_of(value)); });
  }

  // Implement the visits that SpatialIndex requires.
  template <RayVisitor<Object> Visitor>
  void visit_ray(const SlabRay<double>& ray, Visitor& visitor, Work& work) const {
    grid_.visit_ray(
        ray, [&visitor] { return std::as_const(visitor).limit(); }, work,
        [&visitor](const GridRef& value) { return visitor.visit(object_of(value)); });
  }
  template <RegionVisitor<Object> Visitor>
  void visit_region(Visitor& visitor, Work& work) const {
    grid_.visit_region(std::as_const(visitor).bounds(), work,
                       [&visitor](const GridRef& value) { return visitor.visit(object_of(value)); });
  }

  template <PointVisitor<Object> Visitor>
  void visit_nearest(const Vec3d& point, Visitor& visitor, Work& work) const {
    grid_.visit_nearest(
        point, [&visitor] { return std::as_const(visitor).limit(); }, work,
        [&visitor](const GridRef& value) { return visitor.visit(object_of(value)); });
  }

  GridStatistics statistics() const { return grid_.statistics(); }
  // Returns the compounds that the set owns, some of which may be null; null if no object is a compound.
  const CompoundArray* compounds() const { return compounds_.get(); }
  // Returns the size in bytes of the objects, the bricks, the lookup tables, the lists of groups and the compounds.
  // O(bricks + compounds).
  size_t bytes() const { return unshared_bytes(ObjectSet()); }
  // Returns the bytes of this set that `other`, a set of the same scene, does not share. O(size of the difference).
  size_t unshared_bytes(const ObjectSet& other) const {
    const size_t groups = groups_ == nullptr || groups_ == other.groups_ ? 0
                          : other.groups_ == nullptr                     ? groups_->unshared_bytes(GroupLists())
                                                                         : groups_->unshared_bytes(*other.groups_);
    return grid_.unshared_bytes(other.grid_) + handles_.unshared_bytes(other.handles_) + groups +
           locus::unshared_bytes(compounds_, other.compounds_);
  }

 private:
  GridSnapshot grid_;
  PersistentIdTable<> handles_;
  std::shared_ptr<const GroupLists> groups_;        // null if no object belongs to a group
  std::shared_ptr<const CompoundArray> compounds_;  // keeps the compounds of all objects; null if there are none
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_OBJECTS_OBJECT_SET_H_
