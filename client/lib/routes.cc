#include "client/lib/routes.h"

#include <algorithm>
#include <random>
#include <utility>

#include "client/lib/connection.h"

namespace locus::client {
namespace {

// Time for which a server that failed is asked only if there is no other.
constexpr absl::Duration kFailed = absl::Seconds(1);
constexpr absl::Duration kMinPause = absl::Milliseconds(50);
// Times after which the followers of a scene are asked for again, and the same after an attempt that failed.
constexpr absl::Duration kReaders = absl::Seconds(10);
constexpr absl::Duration kReadersAgain = absl::Seconds(2);

const std::string& one_of(const std::vector<std::string>& targets) {
  thread_local std::minstd_rand generator{std::random_device{}()};
  return targets[std::uniform_int_distribution<size_t>(0, targets.size() - 1)(generator)];
}

// Appends an address as a target, unless it is empty.
void append_target(const std::string& address, std::vector<std::string>& targets) {
  if (absl::StatusOr<std::string> target = target_of(address); target.ok()) targets.push_back(*std::move(target));
}

// Removes one entry if there are too many to add another one for `scene`.
template <class Map>
void keep_bounded(Map& known, absl::string_view scene) {
  if (known.size() >= Routes::kMaxScenes && known.find(scene) == known.end()) known.erase(known.begin());
}

template <class Map>
void erase(Map& known, absl::string_view scene) {
  if (const auto found = known.find(scene); found != known.end()) known.erase(found);
}

}  // namespace

Routes::Routes(std::vector<std::string> given, Clock clock) : given_(std::move(given)), clock_(std::move(clock)) {}

std::vector<std::string> Routes::all() const {
  const std::lock_guard lock(mutex_);
  return every();
}

std::string Routes::next(absl::string_view scene) const {
  const std::lock_guard lock(mutex_);
  const auto leader = leaders_.find(scene);
  if (leader != leaders_.end() && leader->second.paused_until <= clock_() && !has_failed(leader->second.target))
    return leader->second.target;
  std::vector<std::string> order = every();
  std::rotate(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(current_), order.end());
  if (leader != leaders_.end() && order.size() > 1) std::erase(order, leader->second.target);
  const auto usable = std::find_if(order.begin(), order.end(), [&](const auto& target) { return !has_failed(target); });
  if (usable != order.end()) return *usable;
  return *std::min_element(order.begin(), order.end(), [&](const std::string& a, const std::string& b) {
    return failed_until_.at(a) < failed_until_.at(b);
  });
}

bool Routes::would_answer(const std::string& target) const {
  const std::lock_guard lock(mutex_);
  return !has_failed(target);
}

void Routes::answered(const std::string& target) {
  const std::lock_guard lock(mutex_);
  failed_until_.erase(target);
}

void Routes::failed(const std::string& target) {
  const std::lock_guard lock(mutex_);
  failed_until_[target] = clock_() + kFailed;
  move_on_from(target);
}

void Routes::has_no_leader(absl::string_view scene, const std::string& target, absl::Duration pause) {
  const std::lock_guard lock(mutex_);
  if (const auto leader = leaders_.find(scene); leader != leaders_.end() && leader->second.target == target)
    leader->second.paused_until = clock_() + std::max(pause, kMinPause);
  move_on_from(target);
}

void Routes::elsewhere(absl::string_view scene, const std::string& teller, const v1::Error& error) {
  std::vector<std::string> named;
  if (error.addresses_size() > 0) append_target(error.addresses(0), named);
  if (named.empty()) return;
  const std::lock_guard lock(mutex_);
  const auto known = leaders_.find(scene);
  const bool stale = known != leaders_.end() && error.token() < known->second.token && known->second.target != teller &&
                     !has_failed(known->second.target);
  if (stale) return;
  keep_bounded(leaders_, scene);
  leaders_[std::string(scene)] = {named.front(), error.token()};
  learn(named.front());
}

void Routes::forget_leader(absl::string_view scene) {
  const std::lock_guard lock(mutex_);
  erase(leaders_, scene);
}

void Routes::forget(absl::string_view scene) {
  const std::lock_guard lock(mutex_);
  erase(leaders_, scene);
  erase(readers_, scene);
  erase(floors_, scene);
}

std::optional<std::string> Routes::reader(absl::string_view scene) {
  const std::lock_guard lock(mutex_);
  const auto found = readers_.find(scene);
  if (found == readers_.end() || found->second.ask_again_at <= clock_()) return std::nullopt;
  Readers& readers = found->second;
  if (has_failed(readers.chosen)) {
    std::vector<std::string> usable = readers.targets;
    std::erase_if(usable, [&](const std::string& target) { return has_failed(target); });
    if (!usable.empty()) readers.chosen = one_of(usable);
  }
  return readers.chosen;
}

void Routes::set_readers(absl::string_view scene, const v1::ScenePlacement* placement, ReadFrom read_from) {
  const std::lock_guard lock(mutex_);
  Readers readers;
  if (const auto old = readers_.find(scene); old != readers_.end()) readers = old->second;
  if (placement != nullptr) {
    readers.targets.clear();
    for (const v1::SceneFollower& follower : placement->followers()) append_target(follower.address(), readers.targets);
    if (read_from != ReadFrom::kFollower || readers.targets.empty())
      append_target(placement->leader(), readers.targets);
  }
  const bool kept = std::find(readers.targets.begin(), readers.targets.end(), readers.chosen) != readers.targets.end();
  if (!kept) readers.chosen = readers.targets.empty() ? std::string() : one_of(readers.targets);
  readers.ask_again_at = clock_() + (placement != nullptr ? kReaders : kReadersAgain);
  keep_bounded(readers_, scene);
  readers_[std::string(scene)] = std::move(readers);
}

void Routes::forget_readers(absl::string_view scene) {
  const std::lock_guard lock(mutex_);
  erase(readers_, scene);
}

std::optional<Revision> Routes::floor(absl::string_view scene) const {
  const std::lock_guard lock(mutex_);
  const auto found = floors_.find(scene);
  return found == floors_.end() ? std::nullopt : std::optional(found->second);
}

void Routes::saw(absl::string_view scene, const Revision& revision, bool from_leader) {
  const std::lock_guard lock(mutex_);
  const auto floor = floors_.find(scene);
  if (floor != floors_.end()) {
    const bool higher =
        revision.epoch == floor->second.epoch ? revision.revision > floor->second.revision : from_leader;
    if (higher) floor->second = revision;
    return;
  }
  keep_bounded(floors_, scene);
  floors_.emplace(std::string(scene), revision);
}

std::vector<std::string> Routes::every() const {
  std::vector<std::string> every = given_;
  every.insert(every.end(), learned_.begin(), learned_.end());
  return every;
}

bool Routes::has_failed(const std::string& target) const {
  const auto found = failed_until_.find(target);
  return found != failed_until_.end() && found->second > clock_();
}

void Routes::move_on_from(const std::string& target) {
  const std::vector<std::string> targets = every();
  if (targets[current_] == target) current_ = (current_ + 1) % targets.size();
}

void Routes::learn(const std::string& target) {
  const std::vector<std::string> known = every();
  if (std::find(known.begin(), known.end(), target) != known.end()) return;
  if (learned_.size() >= kMaxLearned) {
    failed_until_.erase(learned_.front());
    learned_.erase(learned_.begin());
    current_ = 0;
  }
  learned_.push_back(target);
}

}  // namespace locus::client
