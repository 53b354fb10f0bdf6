// Finds small numbers by 64-bit ids: a hash table of open addressing whose copy costs O(1). Copies share their leaves,
// and a write replaces only the leaf it falls into. For the one writer of a scene, whose readers keep copies of earlier
// revisions: both ask the same table.
//
// Threads: as for a standard container, each table by itself: const members may run concurrently, others need exclusive
// use. Tables that share leaves are independent of each other in every way.
//
// Invariants: a bucket is one cache line. An id lies in the first bucket from its own on that had room when it came,
// and each bucket counts the ids that passed it so: a search ends where none has passed, and erasing leaves nothing
// behind. At most three of five places are taken. A leaf that two tables hold is never changed again: each names the
// owner that made it, as in PersistentArray. Source: Knuth, The Art of Computer Programming 3, 6.4 (linear probing,
// buckets); Bronson and Shi, Open-sourcing F14, 2019 (counts of what passed).
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

// Hash()(id): 64 bits, of which the upper ones choose the bucket.
template <class Hash = SeededHash>
class PersistentIdTable {
 public:
  static constexpr uint32_t kNone = ~0u;

  PersistentIdTable() = default;

  // What a reader keeps. O(1).
  PersistentIdTable snapshot() {
    owner_ = internal::kNoOwner;
    return {leaves_.snapshot(), bucket_count_, size_, hash_};
  }

  size_t size() const { return size_; }
  // kNone for an id that is not here, and for kNoId. O(1).
  uint32_t find(Id id) const { return bucket_count_ == 0 ? kNone : find_from(bucket(home(id)), id); }
  // Many at once, numbers[i] for ids[i]: their memory is asked for before it is needed.
  void find(absl::Span<const Id> ids, absl::Span<uint32_t> numbers) const;
  // Asks for the memory of find(), some time before it is needed. GCC would drop calls of what only prefetches, as if
  // it had no effect, unless they are inlined early.
  [[gnu::always_inline]] void prefetch(Id id) const {
    if (bucket_count_ != 0) __builtin_prefetch(&bucket(home(id)));
  }

  // Inserts or replaces; true when the id is new. `id` is not kNoId, `number` not kNone. O(1): copies few leaves at
  // most; the whole table when it is full.
  bool set(Id id, uint32_t number);
  // False when absent. O(1), as set(). Memory goes with fit() only.
  bool erase(Id id);
  // For so many ids, not fewer than there are: makes room for them, or gives back what they leave unused where that is
  // most of the table. O(size) when it does either.
  void fit(size_t ids);

  // Of leaves that snapshots may hold and this table does not any more, since this was last asked.
  size_t take_replaced_bytes() { return std::exchange(replaced_bytes_, 0); }
  size_t bytes() const { return unshared_bytes(PersistentIdTable()); }
  // Of what `other` does not share. O(leaves).
  size_t unshared_bytes(const PersistentIdTable& other) const;

 private:
  static constexpr size_t kSlots = 5;         // of a bucket
  static constexpr size_t kIdsPerBucket = 3;  // on the average, when the table is full
  static constexpr size_t kBucketsPerLeaf = 64;
  static constexpr size_t kIdsPerLeaf = kBucketsPerLeaf * kIdsPerBucket;
  static constexpr size_t kLeavesPerPage = 64;
  static constexpr size_t kFoundAtOnce = 64;

  // An empty place holds kNoId and kNone.
  struct alignas(64) Bucket {
    Bucket() { numbers.fill(kNone); }
    std::array<Id, kSlots> ids{};
    std::array<uint32_t, kSlots> numbers;
    uint32_t passed = 0;
  };
  static_assert(sizeof(Bucket) == 64);
  struct Leaf {
    explicit Leaf(uint64_t maker) : owner(maker) {}
    Leaf(const Leaf& other, uint64_t maker) : buckets(other.buckets), owner(maker) {}
    std::array<Bucket, kBucketsPerLeaf> buckets;
    const uint64_t owner;
  };
  using LeafArray = PersistentArray<std::shared_ptr<Leaf>, kLeavesPerPage>;
  struct Found {
    size_t bucket;
    int place;  // -1: nowhere
  };

  PersistentIdTable(LeafArray leaves, size_t bucket_count, size_t size, const Hash& hash)
      : leaves_(std::move(leaves)), bucket_count_(bucket_count), size_(size), hash_(hash) {}

  static size_t leaves_for(size_t ids) { return (ids + kIdsPerLeaf - 1) / kIdsPerLeaf; }
  size_t leaf_count() const { return bucket_count_ / kBucketsPerLeaf; }
  size_t capacity() const { return leaf_count() * kIdsPerLeaf; }

  // The hash as a fraction of all buckets: the order of homes stays when their number changes.
  size_t home(Id id) const { return absl::Uint128High64(absl::uint128(hash_(id)) * bucket_count_); }
  size_t next(size_t bucket) const { return bucket + 1 == bucket_count_ ? 0 : bucket + 1; }
  const Bucket& bucket(size_t number) const {
    return leaves_[number / kBucketsPerLeaf]->buckets[number % kBucketsPerLeaf];
  }
  // Where of the bucket the id is, or a negative number. Without branches: the place cannot be foretold.
  static int place_of(const Bucket& bucket, Id id) {
    uint32_t places = 0;
    for (size_t place = 0; place < kSlots; ++place) places |= (bucket.ids[place] == id ? 1u : 0u) << place;
    return places == 0 ? -1 : std::countr_zero(places);
  }
  uint32_t find_from(const Bucket& first, Id id) const {
    if (const int place = place_of(first, id); place >= 0) return first.numbers[static_cast<size_t>(place)];
    if (first.passed == 0) return kNone;
    const Found found = search(id);
    return found.place < 0 ? kNone : bucket(found.bucket).numbers[static_cast<size_t>(found.place)];
  }
  Found search(Id id) const;

  void claim_owner() {
    if (owner_ == internal::kNoOwner) owner_ = internal::new_owner();
  }
  Bucket& writable_bucket(size_t number);
  // A new id, where there is room.
  void put(Id id, uint32_t number);
  void rebuild(size_t leaf_count);

  LeafArray leaves_;
  size_t bucket_count_ = 0;
  size_t size_ = 0;
  size_t replaced_bytes_ = 0;
  Hash hash_;
  uint64_t owner_ = internal::kNoOwner;  // whose leaves may be changed in place
};

template <class Hash>
void PersistentIdTable<Hash>::find(absl::Span<const Id> ids, absl::Span<uint32_t> numbers) const {
  if (bucket_count_ == 0) return std::fill(numbers.begin(), numbers.begin() + ids.size(), kNone);
  std::array<const Bucket*, kFoundAtOnce> first;
  for (size_t begin = 0; begin < ids.size(); begin += kFoundAtOnce) {
    const size_t count = std::min(kFoundAtOnce, ids.size() - begin);
    for (size_t i = 0; i < count; ++i) {
      first[i] = &bucket(home(ids[begin + i]));
      __builtin_prefetch(first[i]);
    }
    for (size_t i = 0; i < count; ++i) numbers[begin + i] = find_from(*first[i], ids[begin + i]);
  }
}

template <class Hash>
typename PersistentIdTable<Hash>::Found PersistentIdTable<Hash>::search(Id id) const {
  size_t number = bucket_count_ == 0 ? 0 : home(id);
  // Ids that came before others were erased may have passed every bucket there is.
  for (size_t asked = 0; asked < bucket_count_; ++asked, number = next(number)) {
    const Bucket& here = bucket(number);
    if (const int place = place_of(here, id); place >= 0) return {number, place};
    if (here.passed == 0) break;
  }
  return {0, -1};
}

template <class Hash>
typename PersistentIdTable<Hash>::Bucket& PersistentIdTable<Hash>::writable_bucket(size_t number) {
  claim_owner();
  const size_t leaf = number / kBucketsPerLeaf;
  if (leaves_[leaf]->owner != owner_) {
    leaves_.set(leaf, std::make_shared<Leaf>(*leaves_[leaf], owner_));
    replaced_bytes_ += sizeof(Leaf);
  }
  return leaves_[leaf]->buckets[number % kBucketsPerLeaf];
}

template <class Hash>
void PersistentIdTable<Hash>::put(Id id, uint32_t number) {
  for (size_t at = home(id);; at = next(at)) {
    Bucket& here = writable_bucket(at);
    if (const int place = place_of(here, kNoId); place >= 0) {
      here.ids[static_cast<size_t>(place)] = id;
      here.numbers[static_cast<size_t>(place)] = number;
      return;
    }
    ++here.passed;
  }
}

template <class Hash>
bool PersistentIdTable<Hash>::set(Id id, uint32_t number) {
  LOCUS_DCHECK(id != kNoId && number != kNone);
  if (const Found found = search(id); found.place >= 0) {
    writable_bucket(found.bucket).numbers[static_cast<size_t>(found.place)] = number;
    return false;
  }
  if (size_ == capacity()) fit(size_ + 1);
  put(id, number);
  ++size_;
  return true;
}

template <class Hash>
bool PersistentIdTable<Hash>::erase(Id id) {
  const Found found = id == kNoId ? Found{0, -1} : search(id);
  if (found.place < 0) return false;
  for (size_t passed = home(id); passed != found.bucket; passed = next(passed)) --writable_bucket(passed).passed;
  Bucket& bucket = writable_bucket(found.bucket);
  bucket.ids[static_cast<size_t>(found.place)] = kNoId;
  bucket.numbers[static_cast<size_t>(found.place)] = kNone;
  --size_;
  return true;
}

template <class Hash>
void PersistentIdTable<Hash>::fit(size_t ids) {
  LOCUS_DCHECK(ids >= size_);
  if (ids > capacity()) rebuild(std::max(leaves_for(ids), leaf_count() + leaf_count() / 2));
  if (ids * 4 <= capacity() && leaves_for(2 * ids) < leaf_count()) rebuild(leaves_for(2 * ids));
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
      for (size_t place = 0; place < kSlots; ++place)
        if (bucket.ids[place] != kNoId) put(bucket.ids[place], bucket.numbers[place]);
  }
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
