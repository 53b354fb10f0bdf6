#include "core/scene/snapshot/instances_between.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/planted_bug.h"

namespace locus {
namespace {

// Calls fn(before, after) with both states of each instance that lives in both sets and has moved.
template <class Fn>
void for_each_moved(const StaticSet& at, const StaticSet& next, const Fn& fn) {
  next.tree().for_each_apart_from(at.tree(), [&](const Instance& after) {
    const Instance* const before = at.find(after.id);
    if (before == nullptr || before->life != after.life) return;
    const Transform &from = before->transform, &to = after.transform;
    if (from.translation == to.translation && from.quaternion == to.quaternion && from.scale == to.scale) return;
    fn(*before, after);
  });
}

}  // namespace

uint64_t interpolated_bytes(const StaticSet& at, const StaticSet& next) {
  uint64_t moved = 0;
  for_each_moved(at, next, [&moved](const Instance&, const Instance&) { ++moved; });
  // A moved instance copies at most its block. The nodes above the blocks and their slots are copied, too.
  constexpr uint64_t kBytesAboveAnInstance = 64;
  const uint64_t copied = std::min<uint64_t>(moved * kBvhBlockValues, at.size());
  return moved == 0 ? 0 : copied * 2 * sizeof(Instance) + at.size() * kBytesAboveAnInstance;
}

const StaticSet& InstancesBetween::get() const {
  std::call_once(once_, [this] {
    std::vector<Instance> moved;
    for_each_moved(at_, next_, [&](const Instance& before, const Instance& after) {
      const Transform &from = before.transform, &to = after.transform;
      Instance& instance = moved.emplace_back(before);
      const double scale = double{from.scale} + (double{to.scale} - double{from.scale}) * weight_;
      instance.transform = make_transform(from.translation + (to.translation - from.translation) * weight_,
                                          blended(from.quaternion, to.quaternion, weight_), static_cast<float>(scale));
      instance.bounds = bounds_to_world(instance.transform, instance.mesh->bounds());
    });
    if (!moved.empty()) set_ = at_.replace(std::move(moved));
  });
  return set_ == nullptr ? at_ : *set_;
}

}  // namespace locus
