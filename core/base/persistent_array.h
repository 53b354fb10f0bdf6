// An array whose copy costs O(1): copies share their leaves, and a write replaces only the leaf it falls into and, once
// after each copy, the list of leaves. For the one writer of a scene, whose readers keep copies of earlier revisions.
//
// Threads: as for a standard container, each array object by itself; arrays that share leaves are independent of each
// other, as with PersistentMap.
//
// Invariants: a leaf or list reachable from two arrays is never changed again. Each names the owner that made it; an
// array changes in place only what its present owner made, and snapshot() forgets its owner.
#ifndef LOCUS_CORE_BASE_PERSISTENT_ARRAY_H_
#define LOCUS_CORE_BASE_PERSISTENT_ARRAY_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/persistent_map.h"

namespace locus {

template <class T, size_t kLeafSize>
class PersistentArray {
 public:
  PersistentArray() : list_(std::make_shared<List>()) {}
  PersistentArray(PersistentArray&&) noexcept = default;
  PersistentArray& operator=(PersistentArray&&) noexcept = default;
  // Only of a snapshot that was not written to: whoever writes says snapshot() instead.
  PersistentArray(const PersistentArray& other) : list_(other.list_) { LOCUS_CHECK_EQ(other.owner_, kNoOwner); }
  PersistentArray& operator=(const PersistentArray& other) { return *this = PersistentArray(other); }

  // What a reader keeps. O(1).
  PersistentArray snapshot() {
    owner_ = kNoOwner;
    return PersistentArray(list_);
  }

  // One more than the highest place that was ever set.
  size_t size() const { return list_->size; }
  // `place` is below size(). A place that was never set holds T().
  const T& operator[](size_t place) const { return list_->leaves[place / kLeafSize]->values[place % kLeafSize]; }
  // O(1), or one copy of a leaf; after a snapshot one copy of the list of leaves.
  void set(size_t place, T value);

 private:
  static constexpr uint64_t kNoOwner = 0;
  struct Leaf {
    uint64_t owner = kNoOwner;
    std::array<T, kLeafSize> values{};
  };
  struct List {
    uint64_t owner = kNoOwner;
    size_t size = 0;
    std::vector<std::shared_ptr<Leaf>> leaves;
  };

  explicit PersistentArray(std::shared_ptr<List> list) : list_(std::move(list)) {}
  void make_list_writable();

  std::shared_ptr<List> list_;
  uint64_t owner_ = kNoOwner;  // whose leaves may be changed in place
};

template <class T, size_t kLeafSize>
void PersistentArray<T, kLeafSize>::make_list_writable() {
  if (owner_ == kNoOwner) owner_ = internal::new_map_owner();
  if (list_->owner == owner_) return;
  list_ = std::make_shared<List>(*list_);
  list_->owner = owner_;
}

template <class T, size_t kLeafSize>
void PersistentArray<T, kLeafSize>::set(size_t place, T value) {
  make_list_writable();
  List& list = *list_;
  if (place >= list.size) list.size = place + 1;
  if (place / kLeafSize >= list.leaves.size()) {
    const size_t before = list.leaves.size();
    list.leaves.resize(place / kLeafSize + 1);
    for (size_t leaf = before; leaf < list.leaves.size(); ++leaf) list.leaves[leaf] = std::make_shared<Leaf>();
  }
  std::shared_ptr<Leaf>& leaf = list.leaves[place / kLeafSize];
  if (leaf->owner != owner_) {
    leaf = std::make_shared<Leaf>(*leaf);
    leaf->owner = owner_;
  }
  leaf->values[place % kLeafSize] = std::move(value);
}

}  // namespace locus

#endif  // LOCUS_CORE_BASE_PERSISTENT_ARRAY_H_
