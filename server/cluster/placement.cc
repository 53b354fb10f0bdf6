#include "server/cluster/placement.h"

#include <algorithm>
#include <utility>

namespace locus::server {

void PlacementTable::update(absl::Span<const MemberRow> members, ClusterTime now) {
  table_.clear();
  for (const MemberRow& member : members)
    if (!member.dead && member.load < kTakesNoScenes) table_.push_back({member.id, member.load, 0});
  read_ = now;
}

void PlacementTable::remove(MemberId id) {
  const auto found = std::find_if(table_.begin(), table_.end(), [&](const Candidate& c) { return c.id == id; });
  if (found == table_.end()) return;
  *found = table_.back();
  table_.pop_back();
}

bool PlacementTable::less_loaded(const Candidate& a, const Candidate& b) {
  return std::pair(a.load, a.chosen) < std::pair(b.load, b.chosen);
}

MemberId PlacementTable::count(Candidate& candidate, uint64_t load) {
  candidate.load += load;
  ++candidate.chosen;
  return candidate.id;
}

std::optional<MemberId> PlacementTable::choose(const RandomBits& random, MemberId excluded, uint64_t load) {
  // Move the excluded member to the end, so that the others can be drawn by their indices.
  size_t choices = table_.size();
  if (excluded != 0) {
    const auto found = std::find_if(table_.begin(), table_.end(), [&](const Candidate& c) { return c.id == excluded; });
    if (found != table_.end()) {
      std::swap(*found, table_.back());
      --choices;
    }
  }
  if (choices == 0) return std::nullopt;
  const size_t first = random() % choices;
  if (choices == 1) return count(table_[first], load);
  const size_t second = (first + 1 + random() % (choices - 1)) % choices;
  const bool take_second = less_loaded(table_[second], table_[first]);
  return count(table_[take_second ? second : first], load);
}

std::optional<MemberId> PlacementTable::choose_of(absl::Span<const MemberId> from) {
  Candidate* best = nullptr;
  for (Candidate& candidate : table_) {
    if (std::find(from.begin(), from.end(), candidate.id) == from.end()) continue;
    if (best == nullptr || less_loaded(candidate, *best)) best = &candidate;
  }
  if (best == nullptr) return std::nullopt;
  return count(*best, 0);
}

}  // namespace locus::server
