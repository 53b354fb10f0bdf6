// Persistent array of fixed-size leaves. A snapshot costs O(1), since it shares the leaves and the array of leaf
// pointers (struct List) with its source. After a snapshot, the first write copies the array of leaf pointers, and the
// first write to each leaf copies that leaf. Used by the single writer of a scene, whose readers hold snapshots of
// earlier revisions.
//
// Threads: each array object is like a standard container. Arrays that share leaves are independent: a thread may
// write, copy or destroy its own array while other threads read theirs.
//
// Invariants: a leaf or List that two arrays share is immutable. Each leaf and List stores an owner. When an array
// copies a leaf or List to write to the copy, the copy gets the array's current `owner_` as its owner. At the first
// write after snapshot(), an array sets its `owner_` to a new number. An array changes a leaf or List in place only if
// the stored owner equals the current `owner_` of the array, so no write needs to read reference counts. The number of
// leaves is the smallest that holds size() values. Source of the owner numbers: Clojure's transient collections
// (Hickey).
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
// Owner of leaves and lists that must never be changed in place.
inline constexpr uint64_t kNoOwner = 0;
// Returns a new owner, unique in the process and never kNoOwner. Thread-safe.
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
  // Copies `other`. Precondition: `other` has not been written to since its creation or its last snapshot(). To copy
  // an array that has been written to, call snapshot() of that array.
  PersistentArray(const PersistentArray& other) : list_(other.list_) {
    LOCUS_CHECK_EQ(other.owner_, internal::kNoOwner);
  }
  PersistentArray& operator=(const PersistentArray& other) {
    *this = PersistentArray(other);
    return *this;
  }

  // Returns a snapshot for readers. O(1).
  PersistentArray snapshot() {
    owner_ = internal::kNoOwner;
    LOCUS_DCHECK_CALL(check_invariants());
    return PersistentArray(list_);
  }

  // Returns one more than the highest index that was ever set; 0 if no index was ever set.
  size_t size() const { return list_->size; }
  // Returns the value at `index`, or T() if that value was never set. Precondition: index < size().
  const T& operator[](size_t index) const {
    LOCUS_DCHECK_LT(index, size());
    return list_->leaves[index / kLeafSize]->values[index % kLeafSize];
  }
  // Sets the value at `index`. If index >= size(), extends the array to index + 1 values; the new values before `index`
  // are T(). O(1 + new leaves), plus the copies of the first writes after a snapshot (see the top of this file).
  void set(size_t index, T value);

  // Returns the size in bytes of the parts that this array does not share with `other`: leaves, and the array of
  // pointers to them. O(leaves).
  size_t unshared_bytes(const PersistentArray& other) const;
  // Calls fn(value, other_value) for each index whose leaf is not shared with `other`. `other_value` points to the
  // value of `other` at the same index, or is null if index >= other.size(). O(leaves + calls).
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
  // Checks the number of leaves and the owner of list_. O(1).
  void check_invariants() const {
    LOCUS_CHECK_EQ(list_->leaves.size(), (list_->size + kLeafSize - 1) / kLeafSize);
    LOCUS_CHECK(owner_ == internal::kNoOwner || list_->owner == owner_);
  }
  // Sets owner_ to a new number if it is kNoOwner, and replaces list_ by a copy if list_ stores another owner.
  void make_list_writable();
  // Returns whether this array and `other` share the leaf at index `leaf` of their leaf arrays.
  bool shares_leaf(const PersistentArray& other, size_t leaf) const {
    return leaf < other.list_->leaves.size() && list_->leaves[leaf] == other.list_->leaves[leaf];
  }

  std::shared_ptr<List> list_;
  uint64_t owner_ = internal::kNoOwner;  // owner of the leaves and the List that may be changed in place
};

template <class T, size_t kLeafSize>
void PersistentArray<T, kLeafSize>::make_list_writable() {
  if (owner_ == internal::kNoOwner) owner_ = internal::new_owner();
  if (list_->owner == owner_) return;
  list_ = std::make_shared<List>(*list_);
  list_->owner = owner_;
}

template <class T, size_t kLeafSize>
void PersistentArray<T, kLeafSize>::set(size_t index, T value) {
  make_list_writable();
  List& list = *list_;
  if (index >= list.size) list.size = index + 1;
  if (index / kLeafSize >= list.leaves.size()) {
    const size_t before = list.leaves.size();
    list.leaves.resize(index / kLeafSize + 1);
    for (size_t leaf = before; leaf < list.leaves.size(); ++leaf) list.leaves[leaf] = std::make_shared<Leaf>();
  }
  std::shared_ptr<Leaf>& leaf = list.leaves[index / kLeafSize];
  if (leaf->owner != owner_) {
    leaf = std::make_shared<Leaf>(*leaf);
    leaf->owner = owner_;
  }
  LOCUS_DCHECK_EQ(leaf.use_count(), 1);
  leaf->values[index % kLeafSize] = std::move(value);
  LOCUS_DCHECK_LT(index, size());
  LOCUS_DCHECK_CALL(check_invariants());
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
    for (size_t index = leaf * kLeafSize; index < std::min(size(), (leaf + 1) * kLeafSize); ++index)
      fn((*this)[index], index < other.size() ? &other[index] : nullptr);
  }
}

}  // namespace locus

#endif  // LOCUS_CORE_BASE_PERSISTENT_ARRAY_H_
