// An array whose copy costs O(1): copies share their leaves, and a write replaces only the leaf it falls into and, once
// after each copy, the list of leaves. For the one writer of a scene, whose readers keep copies of earlier revisions.
//
// Threads: as for a standard container, each array object by itself; arrays that share leaves are independent of each
// other in every way: any thread may write to, copy or drop its own while others read theirs.
//
// Invariants: a leaf or list reachable from two arrays is never changed again. Each names the owner that made it; an
// array changes in place only what its present owner made, and snapshot() forgets its owner: no reference count is ever
// asked. Source of owners: Clojure's transient collections (Hickey).
#ifndef LOCUS_CORE_BASE_PERSISTENT_ARRAY_H_
#define LOCUS_CORE_BASE_PERSISTENT_ARRAY_H_

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/check.h"

namespace locus {

namespace internal {
// Who may change a leaf in place.
inline constexpr uint64_t kNoOwner = 0;
// Never kNoOwner and never the same twice.
inline uint64_t new_owner() {
  static std::atomic<uint64_t> last{kNoOwner};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}
}  // namespace internal

template <class T, size_t kLeafSize>
class PersistentArray {
 public:
  PersistentArray() : list_(std::make_shared<List>()) {}
  PersistentArray(PersistentArray&&) noexcept = default;
  PersistentArray& operator=(PersistentArray&&) noexcept = default;
  // Only of a snapshot that was not written to: whoever writes says snapshot() instead.
  PersistentArray(const PersistentArray& other) : list_(other.list_) {
    LOCUS_CHECK_EQ(other.owner_, internal::kNoOwner);
  }
  PersistentArray& operator=(const PersistentArray& other) { return *this = PersistentArray(other); }

  // What a reader keeps. O(1).
  PersistentArray snapshot() {
    owner_ = internal::kNoOwner;
    return PersistentArray(list_);
  }

  // One more than the highest place that was ever set.
  size_t size() const { return list_->size; }
  // `place` is below size(). A place that was never set holds T().
  const T& operator[](size_t place) const { return list_->leaves[place / kLeafSize]->values[place % kLeafSize]; }
  // O(1), or one copy of a leaf; after a snapshot one copy of the list of leaves.
  void set(size_t place, T value);

  // Bytes of leaves and of the list that `other` does not share. O(leaves).
  size_t unshared_bytes(const PersistentArray& other) const;
  // fn(value, other's value) for each place whose leaf `other` does not share; null where it has no such place.
  // O(leaves and places handed over).
  template <class Fn>
  void for_each_apart_from(const PersistentArray& other, const Fn& fn) const;

 private:
  struct Leaf {
    uint64_t owner = internal::kNoOwner;
    std::array<T, kLeafSize> values{};
  };
  struct List {
    uint64_t owner = internal::kNoOwner;
    size_t size = 0;
    std::vector<std::shared_ptr<Leaf>> leaves;
  };

  explicit PersistentArray(std::shared_ptr<List> list) : list_(std::move(list)) {}
  void make_list_writable();
  // Of leaf number `leaf`.
  bool shares_leaf(const PersistentArray& other, size_t leaf) const {
    return leaf < other.list_->leaves.size() && list_->leaves[leaf] == other.list_->leaves[leaf];
  }

  std::shared_ptr<List> list_;
  uint64_t owner_ = internal::kNoOwner;  // whose leaves may be changed in place
};

template <class T, size_t kLeafSize>
void PersistentArray<T, kLeafSize>::make_list_writable() {
  if (owner_ == internal::kNoOwner) owner_ = internal::new_owner();
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

template <class T, size_t kLeafSize>
size_t PersistentArray<T, kLeafSize>::unshared_bytes(const PersistentArray& other) const {
  if (list_ == other.list_) return 0;
  size_t bytes = sizeof(List) + list_->leaves.size() * sizeof(list_->leaves[0]);
  for (size_t leaf = 0; leaf < list_->leaves.size(); ++leaf)
    if (!shares_leaf(other, leaf)) bytes += sizeof(Leaf);
  return bytes;
}

template <class T, size_t kLeafSize>
template <class Fn>
void PersistentArray<T, kLeafSize>::for_each_apart_from(const PersistentArray& other, const Fn& fn) const {
  if (list_ == other.list_) return;
  for (size_t leaf = 0; leaf < list_->leaves.size(); ++leaf) {
    if (shares_leaf(other, leaf)) continue;
    for (size_t place = leaf * kLeafSize; place < std::min(size(), (leaf + 1) * kLeafSize); ++place)
      fn((*this)[place], place < other.size() ? &other[place] : nullptr);
  }
}

}  // namespace locus

#endif  // LOCUS_CORE_BASE_PERSISTENT_ARRAY_H_
