// Instances of a scene at a time between two recorded ticks. An instance exists at this time if it existed at the
// earlier tick, with the labels that it had then. If the same life of the instance exists at the later tick, it moves
// in a straight line and turns at a constant rate, and its scale changes linearly; otherwise it stays in place.
//
// Threads: any. The set is made by the first caller of get(); other callers wait for it.
#ifndef LOCUS_CORE_SCENE_SNAPSHOT_INSTANCES_BETWEEN_H_
#define LOCUS_CORE_SCENE_SNAPSHOT_INSTANCES_BETWEEN_H_

#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "core/scene/statics/static_set.h"

namespace locus {

// Returns an upper bound of the memory of the set of InstancesBetween; 0 if no instance has moved from `at` to `next`.
uint64_t interpolated_bytes(const StaticSet& at, const StaticSet& next);

// Budget of the memory of interpolated sets. Not thread-safe. Borrows the sets that are passed to take().
class InterpolationBudget {
 public:
  explicit InterpolationBudget(uint64_t bytes) : bytes_(bytes), free_(bytes) {}

  // Returns interpolated_bytes(at, next), which is computed once for each pair of sets.
  uint64_t cost(const StaticSet& at, const StaticSet& next) {
    const auto [known, is_new] = costs_.try_emplace(std::pair(&at, &next), 0);
    if (is_new) known->second = interpolated_bytes(at, next);
    return known->second;
  }
  // Takes `bytes`. Returns false, and takes nothing, if fewer are left.
  bool take(uint64_t bytes) {
    if (bytes > free_) return false;
    free_ -= bytes;
    return true;
  }
  uint64_t taken() const { return bytes_ - free_; }
  // Returns the number of pairs of sets that were compared.
  size_t pairs() const { return costs_.size(); }

 private:
  const uint64_t bytes_;
  uint64_t free_;
  absl::flat_hash_map<std::pair<const StaticSet*, const StaticSet*>, uint64_t> costs_;
};

class InstancesBetween {
 public:
  // Borrows `at` and `next`, with 0 <= weight <= 1.
  InstancesBetween(const StaticSet& at, const StaticSet& next, double weight) : at_(at), next_(next), weight_(weight) {}

  // Returns the interpolated set, or `at` if no instance has moved. The first call costs O(instances that moved) and
  // the cost of StaticSet::replace().
  const StaticSet& get() const;

 private:
  const StaticSet& at_;
  const StaticSet& next_;
  const double weight_;
  mutable std::once_flag once_;
  mutable std::shared_ptr<const StaticSet> set_;  // null if no instance has moved
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_SNAPSHOT_INSTANCES_BETWEEN_H_
