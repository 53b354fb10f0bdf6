// Persistent hash table from 64-bit ids to 32-bit values, with open addressing: a snapshot costs O(1), since snapshots
// share their leaves, and a write copies only the leaves that it changes. Used by the only writer of a scene, whose
// readers keep snapshots of earlier revisions.
//
// Threads: each table is like a standard container: const members may run concurrently, other members need exclusive
// access. Tables that share leaves are independent: a thread may write its own table while other threads read theirs.
//
// Invariants: a bucket is one cache line. The hash of an id selects its home bucket. An id is stored in the first
// bucket, from its home bucket on, that had a free slot when the id was inserted. Each full bucket that an insertion
// skipped counts the inserted id in `overflow`. A search that has not found the id ends at the first bucket with an
// overflow of 0. erase() decrements the counts, so no tombstones are needed. On average, at most three of the five
// slots of a bucket are used. A leaf that two tables share is immutable. Each leaf stores as its owner the `owner_` of
// the table at the time when the table created the leaf. A table changes a leaf in place only if this owner equals its
// current `owner_`. Source: Knuth, The Art of Computer Programming 3, 6.4 (linear probing, buckets); Bronson and Shi,
// Open-sourcing F14, 2019 (overflow counts).
#ifndef LOCUS_CORE_BASE_PERSISTENT_ID_TABLE_H_
#define LOCUS_CORE_BASE_PERSISTENT_ID_TABLE_H_

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "absl/numeric/int128.h"
#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/ids.h"
#include "core/base/persistent_array.h"
#include "core/base/seeded_hash.h"

namespace locus {

// Persistent table of ids. `Hash()(id)` must return 64 bits; the upper bits choose the home bucket (see the top of this
// file).
template <class Hash = SeededHash>
class PersistentIdTable {
 public:
  // Result of find() for an absent id; never a stored value.
  static constexpr uint32_t kNone = ~0u;

  PersistentIdTable() = default;

  // Returns a snapshot for readers. O(1).
  PersistentIdTable snapshot() {
    owner_ = internal::kNoOwner;
    LOCUS_DCHECK_CALL(check_invariants());
    return {leaves_.snapshot(), bucket_count_, size_, hash_};
  }

  size_t size() const { return size_; }
  // Returns the value of `id`, or kNone if `id` is absent or kNoId. O(1).
  uint32_t find(Id id) const { return bucket_count_ == 0 ? kNone : find_from(bucket(home(id)), id); }
  // Writes the value of ids[i], or kNone if that id is absent, to values[i]. Requires values.size() >= ids.size().
  // Faster than one find(id) per id, because this function prefetches the buckets.
  void find(absl::Span<const Id> ids, absl::Span<uint32_t> values) const;
  // Prefetches the bucket that find(id) reads first. Always inlined, since GCC otherwise drops calls of functions that
  // only prefetch.
  [[gnu::always_inline]] void prefetch(Id id) const {
    if (bucket_count_ != 0) __builtin_prefetch(&bucket(home(id)));
  }

  // Inserts or replaces the value of `id`; returns true if the id is new. Preconditions: `id` is not kNoId, `value` is
  // not kNone. O(1), plus a copy of each leaf that is changed for the first time after a snapshot; O(size) if the table
  // is full and grows.
  bool set(Id id, uint32_t value);
  // Removes `id`; returns false if the id is absent. O(1), plus copies of leaves as in set(). The table keeps its
  // memory until fit() shrinks it.
  bool erase(Id id);
  // Resizes the table for `ids` ids; `ids` must be at least size(). Grows the table if `ids` exceeds its capacity.
  // Shrinks the table if `ids` is at most a quarter of its capacity and 2 * `ids` ids need fewer leaves than the table
  // has. O(size) if the table is resized, else O(1).
  void fit(size_t ids);

  // Returns the size in bytes of the leaves that this table has replaced since the last call of this function. Only
  // snapshots still hold the replaced leaves.
  size_t take_replaced_bytes() { return std::exchange(replaced_bytes_, 0); }
  size_t bytes() const { return unshared_bytes(PersistentIdTable()); }
  // Returns the size in bytes of the leaves, and of the array of leaf pointers, that this table does not share with
  // `other`. O(leaves).
  size_t unshared_bytes(const PersistentIdTable& other) const;

 private:
  static constexpr size_t kSlots = 5;         // slots in a bucket
  static constexpr size_t kIdsPerBucket = 3;  // average number of ids in a bucket of a full table
  static constexpr size_t kBucketsPerLeaf = 64;
  static constexpr size_t kIdsPerLeaf = kBucketsPerLeaf * kIdsPerBucket;
  static constexpr size_t kLeavesPerPage = 64;
  static constexpr size_t kFindBatch = 64;

  // Bucket of kSlots slots in one cache line. An empty slot holds kNoId and kNone.
  struct alignas(64) Bucket {
    Bucket() { values.fill(kNone); }
    std::array<Id, kSlots> ids{};
    std::array<uint32_t, kSlots> values;
    uint32_t overflow = 0;  // number of ids stored in later buckets because this bucket was full
  };
  static_assert(sizeof(Bucket) == 64);
  struct Leaf {
    explicit Leaf(uint64_t creator) : owner(creator) {}
    Leaf(const Leaf& other, uint64_t creator) : buckets(other.buckets), owner(creator) {}
    std::array<Bucket, kBucketsPerLeaf> buckets;
    const uint64_t owner;
  };
  using LeafArray = PersistentArray<std::shared_ptr<Leaf>, kLeavesPerPage>;
  struct Position {
    size_t bucket;
    int slot;  // slot in the bucket, -1 if the id is absent
  };

  PersistentIdTable(LeafArray leaves, size_t bucket_count, size_t size, const Hash& hash)
      : leaves_(std::move(leaves)), bucket_count_(bucket_count), size_(size), hash_(hash) {}

  static size_t leaves_for(size_t ids) { return (ids + kIdsPerLeaf - 1) / kIdsPerLeaf; }
  size_t leaf_count() const { return bucket_count_ / kBucketsPerLeaf; }
  size_t capacity() const { return leaf_count() * kIdsPerLeaf; }

  // Returns the index of the home bucket: the hash, as a fraction of 2^64, times the number of buckets. So the order of
  // ids by home bucket is the same for any number of buckets.
  size_t home(Id id) const { return absl::Uint128High64(absl::uint128(hash_(id)) * bucket_count_); }
  size_t next(size_t bucket) const { return bucket + 1 == bucket_count_ ? 0 : bucket + 1; }
  const Bucket& bucket(size_t index) const {
    LOCUS_DCHECK_LT(index, bucket_count_);
    return leaves_[index / kBucketsPerLeaf]->buckets[index % kBucketsPerLeaf];
  }
  // Returns the slot of `id` in `bucket`, or -1. Branch-free, since the processor cannot predict the slot.
  static int slot_of(const Bucket& bucket, Id id) {
    uint32_t matches = 0;
    for (size_t slot = 0; slot < kSlots; ++slot) matches |= (bucket.ids[slot] == id ? 1u : 0u) << slot;
    return matches == 0 ? -1 : std::countr_zero(matches);
  }
  // Returns the value of `id`, whose home bucket is `first`; kNone if the id is absent.
  uint32_t find_from(const Bucket& first, Id id) const {
    if (const int slot = slot_of(first, id); slot >= 0) return first.values[static_cast<size_t>(slot)];
    if (first.overflow == 0) return kNone;
    const Position found = search(id);
    return found.slot < 0 ? kNone : bucket(found.bucket).values[static_cast<size_t>(found.slot)];
  }
  // Searches for `id` in the buckets from its home bucket on. Returns slot -1 if the id is absent.
  Position search(Id id) const;

  void claim_owner() {
    if (owner_ == internal::kNoOwner) owner_ = internal::new_owner();
  }
  // Returns bucket `index` for writing; first copies its leaf if another owner created the leaf.
  Bucket& writable_bucket(size_t index);
  // Inserts an absent id. Precondition: size() < capacity().
  void put(Id id, uint32_t value);
  // Replaces the leaves by `leaf_count` new leaves with the same ids and values.
  void rebuild(size_t leaf_count);
  // Checks that the numbers of ids, buckets and leaves agree. O(1).
  void check_invariants() const;
  // Checks a bucket: each slot is empty or full, and each id is reachable from its home bucket.
  void check_bucket(size_t index) const;
  // Checks each bucket, and that all buckets together contain size() ids. O(size), so it is called only after a
  // rebuild.
  void check_all_buckets() const;

  LeafArray leaves_;
  size_t bucket_count_ = 0;
  size_t size_ = 0;
  size_t replaced_bytes_ = 0;
  Hash hash_;
  uint64_t owner_ = internal::kNoOwner;  // owner of the leaves that may be changed in place
};

template <class Hash>
void PersistentIdTable<Hash>::find(absl::Span<const Id> ids, absl::Span<uint32_t> values) const {
  LOCUS_DCHECK_GE(values.size(), ids.size());
  if (bucket_count_ == 0) return std::fill(values.begin(), values.begin() + ids.size(), kNone);
  std::array<const Bucket*, kFindBatch> first;
  for (size_t begin = 0; begin < ids.size(); begin += kFindBatch) {
    const size_t count = std::min(kFindBatch, ids.size() - begin);
    for (size_t i = 0; i < count; ++i) {
      first[i] = &bucket(home(ids[begin + i]));
      __builtin_prefetch(first[i]);
    }
    for (size_t i = 0; i < count; ++i) values[begin + i] = find_from(*first[i], ids[begin + i]);
  }
}

template <class Hash>
typename PersistentIdTable<Hash>::Position PersistentIdTable<Hash>::search(Id id) const {
  size_t index = bucket_count_ == 0 ? 0 : home(id);
  // After erasures the overflow counts of all buckets may be positive, so the search also ends after one probe of each
  // bucket.
  for (size_t probes = 0; probes < bucket_count_; ++probes, index = next(index)) {
    const Bucket& current = bucket(index);
    if (const int slot = slot_of(current, id); slot >= 0) return {index, slot};
    if (current.overflow == 0) break;
  }
  return {0, -1};
}

template <class Hash>
typename PersistentIdTable<Hash>::Bucket& PersistentIdTable<Hash>::writable_bucket(size_t index) {
  claim_owner();
  LOCUS_DCHECK_LT(index, bucket_count_);
  const size_t leaf = index / kBucketsPerLeaf;
  if (leaves_[leaf]->owner != owner_) {
    leaves_.set(leaf, std::make_shared<Leaf>(*leaves_[leaf], owner_));
    replaced_bytes_ += sizeof(Leaf);
  }
  LOCUS_DCHECK_EQ(leaves_[leaf]->owner, owner_);
  return leaves_[leaf]->buckets[index % kBucketsPerLeaf];
}

template <class Hash>
void PersistentIdTable<Hash>::put(Id id, uint32_t value) {
  LOCUS_DCHECK_LT(size_, capacity());
  for (size_t index = home(id);; index = next(index)) {
    Bucket& current = writable_bucket(index);
    if (const int slot = slot_of(current, kNoId); slot >= 0) {
      current.ids[static_cast<size_t>(slot)] = id;
      current.values[static_cast<size_t>(slot)] = value;
      return;
    }
    ++current.overflow;
  }
}

template <class Hash>
bool PersistentIdTable<Hash>::set(Id id, uint32_t value) {
  LOCUS_DCHECK_NE(id, kNoId);
  LOCUS_DCHECK_NE(value, kNone);
  if (const Position found = search(id); found.slot >= 0) {
    writable_bucket(found.bucket).values[static_cast<size_t>(found.slot)] = value;
    LOCUS_DCHECK_CALL(check_invariants());
    return false;
  }
  if (size_ == capacity()) fit(size_ + 1);
  put(id, value);
  ++size_;
  LOCUS_DCHECK_CALL(check_bucket(search(id).bucket));
  LOCUS_DCHECK_CALL(check_invariants());
  return true;
}

template <class Hash>
bool PersistentIdTable<Hash>::erase(Id id) {
  const Position found = id == kNoId ? Position{0, -1} : search(id);
  if (found.slot < 0) return false;
  for (size_t index = home(id); index != found.bucket; index = next(index)) {
    Bucket& skipped = writable_bucket(index);
    LOCUS_DCHECK_GT(skipped.overflow, 0u);
    --skipped.overflow;
  }
  Bucket& bucket = writable_bucket(found.bucket);
  bucket.ids[static_cast<size_t>(found.slot)] = kNoId;
  bucket.values[static_cast<size_t>(found.slot)] = kNone;
  LOCUS_DCHECK_GT(size_, 0u);
  --size_;
  LOCUS_DCHECK_CALL(check_bucket(found.bucket));
  LOCUS_DCHECK_CALL(check_invariants());
  return true;
}

template <class Hash>
void PersistentIdTable<Hash>::fit(size_t ids) {
  LOCUS_DCHECK_GE(ids, size_);
  if (ids > capacity()) rebuild(std::max(leaves_for(ids), leaf_count() + leaf_count() / 2));
  if (ids * 4 <= capacity() && leaves_for(2 * ids) < leaf_count()) rebuild(leaves_for(2 * ids));
  LOCUS_DCHECK_GE(capacity(), ids);
  LOCUS_DCHECK_CALL(check_invariants());
}

template <class Hash>
void PersistentIdTable<Hash>::rebuild(size_t leaf_count) {
  claim_owner();
  const LeafArray before = std::exchange(leaves_, LeafArray());
  for (size_t leaf = 0; leaf < leaf_count; ++leaf) leaves_.set(leaf, std::make_shared<Leaf>(owner_));
  bucket_count_ = leaf_count * kBucketsPerLeaf;
  for (size_t leaf = 0; leaf < before.size(); ++leaf) {
    if (before[leaf]->owner != owner_) replaced_bytes_ += sizeof(Leaf);
    for (const Bucket& bucket : before[leaf]->buckets)
      for (size_t slot = 0; slot < kSlots; ++slot)
        if (bucket.ids[slot] != kNoId) put(bucket.ids[slot], bucket.values[slot]);
  }
  LOCUS_DCHECK_CALL(check_all_buckets());
}

template <class Hash>
void PersistentIdTable<Hash>::check_invariants() const {
  LOCUS_CHECK_LE(size_, capacity());
  LOCUS_CHECK_EQ(bucket_count_ % kBucketsPerLeaf, 0u);
  LOCUS_CHECK_EQ(leaves_.size(), leaf_count());
}

template <class Hash>
void PersistentIdTable<Hash>::check_bucket(size_t index) const {
  const Bucket& checked = bucket(index);
  for (size_t slot = 0; slot < kSlots; ++slot) {
    const Id id = checked.ids[slot];
    LOCUS_CHECK_EQ(id == kNoId, checked.values[slot] == kNone);
    if (id == kNoId) continue;
    const Position found = search(id);
    LOCUS_CHECK_EQ(found.slot, static_cast<int>(slot));
    LOCUS_CHECK_EQ(found.bucket, index);
  }
}

template <class Hash>
void PersistentIdTable<Hash>::check_all_buckets() const {
  size_t ids = 0;
  for (size_t index = 0; index < bucket_count_; ++index) {
    LOCUS_DCHECK_CALL(check_bucket(index));
    for (const Id id : bucket(index).ids) ids += id != kNoId ? 1 : 0;
  }
  LOCUS_CHECK_EQ(ids, size_);
}

template <class Hash>
size_t PersistentIdTable<Hash>::unshared_bytes(const PersistentIdTable& other) const {
  size_t bytes = leaves_.unshared_bytes(other.leaves_);
  leaves_.for_each_apart_from(other.leaves_, [&bytes](const auto& leaf, const auto* theirs) {
    if (theirs == nullptr || leaf != *theirs) bytes += sizeof(Leaf);
  });
  return bytes;
}

}  // namespace locus

#endif  // LOCUS_CORE_BASE_PERSISTENT_ID_TABLE_H_
