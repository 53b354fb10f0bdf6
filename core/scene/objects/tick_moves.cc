#include "core/scene/objects/tick_moves.h"

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/base/planted_bug.h"

namespace locus {

void TickMoves::check_invariants() const {
  LOCUS_CHECK_LE(fast_.size(), kMaxFast);
  LOCUS_CHECK_LE(displacement_.bound, fast_length_);
  for (size_t i = 0; i < fast_.size(); ++i) {
    if (i > 0) LOCUS_CHECK_LT(fast_[i - 1].handle, fast_[i].handle);
    LOCUS_CHECK_LT(fast_length_, fast_[i].length);
    LOCUS_CHECK_LT(size_t{fast_[i].handle}, starts_.size());
    const Start& start = starts_[fast_[i].handle];
    LOCUS_CHECK(start.tick == tick_ && start.kind == Kind::kListed);
  }
}

void TickMoves::start_tick(double fast_length) {
  LOCUS_DCHECK_GE(fast_length, 0.0);
  ++tick_;
  fast_length_ = fast_length;
  fast_.clear();
  fast_changed_ = false;
  displacement_ = {};
}

TickMoves::Start& TickMoves::start_of(uint32_t handle) {
  if (handle >= starts_.size()) starts_.resize(std::max<size_t>(handle + size_t{1}, starts_.size() * 3 / 2));
  return starts_[handle];
}

void TickMoves::born(uint32_t handle) {
  Start& start = start_of(handle);
  LOCUS_DCHECK(start.tick != tick_ || start.kind != Kind::kListed);  // handles are not reused within a tick
  start = {{}, tick_, 0, Kind::kNewborn};
}

void TickMoves::moved(const GridRef& before, Vec3d to) {
  Start& start = start_of(before.handle());
  if (start.tick != tick_) start = {before.entry().position, tick_, before.reach(), Kind::kOrdinary};
  if (start.kind == Kind::kNewborn) return;
  const double length = std::sqrt(squared_length(to - start.position));
  const bool listed = start.kind == Kind::kListed && !planted(PlantedBug::kRewindFastBox);
  if (listed || length > fast_length_) {
    add_fast(before.handle(), start, to, length);
    LOCUS_DCHECK_CALL(check_invariants());
    return;
  }
  displacement_.bound = std::max(displacement_.bound, length);
  LOCUS_DCHECK_LE(displacement_.bound, fast_length_);
}

void TickMoves::add_fast(uint32_t handle, Start& start, Vec3d to, double length) {
  const auto at = std::lower_bound(fast_.begin(), fast_.end(), handle,
                                   [](const FastMover& mover, uint32_t value) { return mover.handle < value; });
  const Aabbd centers{min(start.position, to), max(start.position, to)};
  fast_changed_ = true;
  if (at != fast_.end() && at->handle == handle) {
    at->length = std::max(at->length, length);
    at->centers = merge(at->centers, centers);
    return;
  }
  start.kind = Kind::kListed;
  fast_.insert(at, {handle, start.extent, length, centers});
  if (fast_.size() > kMaxFast) list_fewer();
}

void TickMoves::list_fewer() {
  LOCUS_DCHECK_GT(fast_length_, 0.0);  // if fast_length_ were 0, doubling would not raise it
  while (fast_.size() > kMaxFast / 2) {
    fast_length_ *= 2;
    std::erase_if(fast_, [this](const FastMover& mover) {
      if (mover.length > fast_length_) return false;
      displacement_.bound = std::max(displacement_.bound, mover.length);
      starts_[mover.handle].kind = Kind::kOrdinary;
      return true;
    });
  }
}

const Displacement& TickMoves::displacement() {
  if (!std::exchange(fast_changed_, false)) return displacement_;
  displacement_.fast = fast_.empty() ? nullptr : std::make_shared<const std::vector<FastMover>>(fast_);
  return displacement_;
}

}  // namespace locus
