#include "server/services/cluster/scene_directory.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"

namespace locus::server {
namespace {

using std::chrono::steady_clock;

// Time after which a caller asks again for a scene that is being looked up.
constexpr uint32_t kLookUpMs = 20;

}  // namespace

SceneDirectory::SceneDirectory(const PostgresLog& log, ClusterEngine& engine)
    : log_(log), engine_(engine), thread_([this] { run(); }) {}

SceneDirectory::~SceneDirectory() {
  {
    const MutexLock lock(mutex_);
    ended_ = true;
    asked_soon_.notify_all();
  }
  thread_.join();
}

absl::StatusOr<std::optional<CatalogueScene>> SceneDirectory::look_up(const std::string& name) {
  const Time asked = steady_clock::now();
  ASSIGN_OR_RETURN(std::optional<CatalogueScene> scene, log_.find_catalogued(name));
  if (scene) refresh_members(scene->member);
  store(name, scene, asked);
  return scene;
}

absl::StatusOr<std::optional<CatalogueScene>> SceneDirectory::known(const std::string& name) {
  const MutexLock lock(mutex_);
  const auto found = entries_.find(name);
  const bool fresh = found != entries_.end() && found->second.read + kFresh >= steady_clock::now();
  if (!fresh) ask(name);
  const bool has_leader = found != entries_.end() && found->second.scene && found->second.scene->member != 0;
  if (fresh || has_leader) return found->second.scene;
  return no_leader(absl::StrCat("the cluster is asked who leads the scene '", name, "'"), kLookUpMs);
}

void SceneDirectory::forget(const std::string& name) {
  const MutexLock lock(mutex_);
  if (entries_.size() >= kMaxEntries && !entries_.contains(name)) entries_.clear();
  entries_[name] = {std::nullopt, Time::min(), steady_clock::now()};
}

void SceneDirectory::ask(const std::string& name) {
  if (asked_.size() >= kMaxAsked || !waiting_.insert(name).second) return;
  asked_.push_back(name);
  asked_soon_.notify_all();
}

void SceneDirectory::store(const std::string& name, const std::optional<CatalogueScene>& scene, Time asked) {
  const MutexLock lock(mutex_);
  if (entries_.size() >= kMaxEntries && !entries_.contains(name)) entries_.clear();
  Entry& entry = entries_[name];
  if (asked < entry.forgotten) return;
  entry.read = steady_clock::now();
  // An older answer can arrive later; the tokens of one scene only increase.
  const bool older = scene && entry.scene && scene->key == entry.scene->key && scene->token < entry.scene->token;
  if (!older) entry.scene = scene;
}

std::vector<MemberRow> SceneDirectory::members() {
  refresh_members(0);
  const MutexLock lock(mutex_);
  return members_;
}

std::vector<MemberRow> SceneDirectory::known_members() {
  const MutexLock lock(mutex_);
  if (!members_read_ || steady_clock::now() - *members_read_ > kFreshMembers) {
    members_asked_ = true;
    asked_soon_.notify_all();
  }
  return members_;
}

std::string SceneDirectory::address_of(MemberId member) const {
  const MutexLock lock(mutex_);
  const auto found =
      std::find_if(members_.begin(), members_.end(), [member](const MemberRow& row) { return row.id == member; });
  return found == members_.end() ? std::string() : found->info.address;
}

void SceneDirectory::refresh_members(MemberId wanted) {
  {
    const MutexLock lock(mutex_);
    const bool fresh = members_read_ && steady_clock::now() - *members_read_ <= kFreshMembers;
    const bool has_wanted = wanted == 0 || std::any_of(members_.begin(), members_.end(),
                                                       [wanted](const MemberRow& row) { return row.id == wanted; });
    if (fresh && has_wanted) return;
  }
  absl::StatusOr<std::vector<MemberRow>> rows = engine_.members();
  if (!rows.ok()) return;
  std::sort(rows->begin(), rows->end(),
            [](const MemberRow& a, const MemberRow& b) { return a.info.address < b.info.address; });
  const MutexLock lock(mutex_);
  members_ = *std::move(rows);
  members_read_ = steady_clock::now();
}

void SceneDirectory::run() {
  while (true) {
    std::string name;
    bool members = false;
    {
      const MutexLock lock(mutex_);
      while (asked_.empty() && !members_asked_ && !ended_) asked_soon_.wait(mutex_);
      if (ended_) return;
      members = std::exchange(members_asked_, false);
      if (!asked_.empty()) {
        name = std::move(asked_.front());
        asked_.pop_front();
      }
    }
    if (members) refresh_members(0);
    if (name.empty()) continue;
    look_up(name).IgnoreError();
    const MutexLock lock(mutex_);
    waiting_.erase(name);
  }
}

}  // namespace locus::server
