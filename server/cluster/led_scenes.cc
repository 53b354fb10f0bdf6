#include "server/cluster/led_scenes.h"

#include <utility>

#include "core/base/check.h"
#include "core/base/planted_bug.h"

namespace locus::server {

LedScenes::Started LedScenes::start(const LeaderRow& row, std::shared_ptr<const MemberLease> member) {
  const MutexLock lock(mutex_);
  std::shared_ptr<SceneLease>& lease = scenes_[row.key];
  if (lease != nullptr) {
    if (lease->token() >= row.token) return {};
    lease->stop();
    stopped_.push_back({row.key, lease->token(), StopReason::kFenced});
  }
  lease = std::make_shared<SceneLease>(row.key, row.token, std::move(member));
  return {lease, std::exchange(stopped_, {})};
}

bool LedScenes::stop(SceneKey scene, Token token, StopReason reason) {
  const MutexLock lock(mutex_);
  const auto found = scenes_.find(scene);
  if (found == scenes_.end() || found->second->token() != token) return false;
  found->second->stop();
  scenes_.erase(found);
  stopped_.push_back({scene, token, reason});
  return true;
}

void LedScenes::stop_all(StopReason reason) {
  const MutexLock lock(mutex_);
  for (const auto& [scene, lease] : scenes_) {
    lease->stop();
    stopped_.push_back({scene, lease->token(), reason});
  }
  scenes_.clear();
}

bool LedScenes::raise(SceneKey scene, Token before, Token now) {
  const MutexLock lock(mutex_);
  const auto found = scenes_.find(scene);
  if (found == scenes_.end() || found->second->token() != before) return false;
  LOCUS_CHECK_LT(before, now);
  found->second->raise(now);
  return true;
}

std::optional<Token> LedScenes::take(SceneKey scene) {
  const MutexLock lock(mutex_);
  const auto found = scenes_.find(scene);
  if (found == scenes_.end()) return std::nullopt;
  if (!planted(PlantedBug::kHandedOverLeadsOn)) found->second->stop();
  const Token token = found->second->token();
  scenes_.erase(found);
  return token;
}

std::vector<LedScenes::Stopped> LedScenes::take_stopped() {
  const MutexLock lock(mutex_);
  return std::exchange(stopped_, {});
}

std::shared_ptr<const SceneLease> LedScenes::find(SceneKey scene) const {
  const MutexLock lock(mutex_);
  const auto found = scenes_.find(scene);
  if (found == scenes_.end()) return nullptr;
  return found->second;
}

std::vector<SceneKey> LedScenes::keys() const {
  const MutexLock lock(mutex_);
  std::vector<SceneKey> keys;
  keys.reserve(scenes_.size());
  for (const auto& [scene, lease] : scenes_) keys.push_back(scene);
  return keys;
}

size_t LedScenes::size() const {
  const MutexLock lock(mutex_);
  return scenes_.size();
}

}  // namespace locus::server
