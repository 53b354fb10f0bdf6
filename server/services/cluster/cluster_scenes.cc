#include "server/services/cluster/cluster_scenes.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <random>
#include <set>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "core/scene/log/state_writer.h"
#include "core/scene/recovery.h"
#include "core/scene/spec_codec.h"
#include "server/config/version.h"
#include "server/convert/status.h"
#include "server/host/epoch.h"
#include "server/observability/log.h"
#include "server/services/cluster/cluster_meshes.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Waiting jobs of one scene: a leadership that ended, and the next one.
constexpr uint32_t kMaxJobs = 1'000;
// Times after which a caller tries again while a scene has no leader, and while its leader reads it.
constexpr uint32_t kNoLeaderMs = 250;
constexpr uint32_t kReadingMs = 50;
// Interval between attempts to read a scene, and at which wait_for() looks again.
constexpr milliseconds kReadAgain{200};
constexpr milliseconds kPoll{5};
// Time that wait_for() gives a scene to be read.
constexpr milliseconds kWait{1'000};
// Load of a scene itself, in objects: its updates and queries cost time even if it is small.
constexpr uint64_t kSceneLoad = 1'000;

uint64_t random_seed() {
  std::random_device device;
  return uint64_t{device()} << 32 | device();
}

ClusterMember::Options options_of(const Host& host, const std::string& address) {
  ClusterMember::Options options;
  options.info = {address, host.config.zone, kVersion};
  options.seed = random_seed();
  return options;
}

absl::Status exists(const std::string& name) {
  Refusal refusal;
  refusal.reason = Reason::kAlreadyExists;
  refusal.field = "name";
  return refuse(absl::StatusCode::kAlreadyExists,
                absl::StrCat("scene ", name, " exists; choose another name or set if_absent"), refusal);
}

absl::Status being_read(absl::string_view name) {
  return no_leader(absl::StrCat("this server leads the scene '", name, "' and is still reading it"), kReadingMs);
}

}  // namespace

ClusterScenes::ClusterScenes(Host& host, ClusterStorage& storage, const std::string& address)
    : host_(host),
      log_(*storage.log),
      address_(address),
      engine_hosts_(storage.hosts),
      appends_(*storage.appends),
      directory_(*storage.log, *storage.engine),
      member_(*storage.engine, *this, options_of(host, address)),
      readers_(std::make_unique<ChangeQueue>(kReaders, kMaxJobs)) {}

void ClusterScenes::start() {
  started_ = true;
  member_.start();
}

void ClusterScenes::end() {
  if (ended_.exchange(true)) return;
  member_.stop();
  std::unique_ptr<ChangeQueue> readers;  // ends without the lock, which its jobs take
  {
    const MutexLock lock(mutex_);
    readers = std::move(readers_);
  }
  readers.reset();
  const MutexLock lock(mutex_);
  led_.clear();
  keys_.clear();
}

void ClusterScenes::submit(SceneKey key, std::function<void()> job) {
  const MutexLock lock(mutex_);
  if (readers_ == nullptr) return;
  const absl::StatusOr<uint64_t> queued = readers_->submit(key, [job = std::move(job)](uint64_t) { job(); });
  if (!queued.ok()) log(LogLevel::kError, "too many jobs of a scene wait", {{"scene", absl::StrCat(key)}});
}

std::pair<SceneKey, ClusterScenes::Led> ClusterScenes::find_led(const std::string& name) const {
  const MutexLock lock(mutex_);
  for (const auto& [key, led] : led_)
    if (led.name == name) return {key, led};
  return {};
}

bool ClusterScenes::leads(SceneKey key) const {
  const MutexLock lock(mutex_);
  return led_.contains(key);
}

absl::StatusOr<ClusterScenes::Created> ClusterScenes::create(const std::string& name, const SceneSpec& spec,
                                                             uint64_t epoch, const std::string& static_from,
                                                             bool if_absent) {
  ASSIGN_OR_RETURN(std::optional<CatalogueScene> row, directory_.look_up(name));
  if (row && !if_absent) return exists(name);
  if (row) return Created{*std::move(row), true};
  std::shared_ptr<const StaticSet> statics = StaticSet::empty();
  if (!static_from.empty()) {
    const absl::StatusOr<ScenePtr> source = wait_for(static_from);
    if (absl::IsNotFound(source.status())) return Registry::no_source(static_from);
    RETURN_IF_ERROR(source.status());
    statics = (*source)->latest()->statics;
  }
  std::vector<MeshUse> uses;
  for (const StaticMesh* mesh : statics->meshes()) uses.push_back({mesh->name(), mesh->sha256(), statics->uses(mesh)});
  SceneWriter writer(epoch, spec.winding, std::move(statics), limits::kMaxObjects, spec.history);
  FrozenScene beginning;
  beginning.snapshot = writer.published();
  StateWriter state(std::move(beginning));
  const absl::StatusOr<SceneKey> key = log_.create_unled_scene(
      name, encode_spec(spec), epoch, [&state] { return state.next(); }, uses);
  if (absl::IsAlreadyExists(key.status())) {  // created by another call meanwhile
    ASSIGN_OR_RETURN(row, directory_.look_up(name));
    if (!row || !if_absent) return exists(name);
    return Created{*std::move(row), true};
  }
  RETURN_IF_ERROR(key.status());
  CatalogueScene created;
  created.key = *key;
  created.name = name;
  created.spec = encode_spec(spec);
  created.epoch = epoch;
  // Without a leader the scene exists all the same: a member gives it one within seconds.
  if (const absl::StatusOr<LeaderRow> leader = member_.place(*key); leader.ok()) {
    created.member = leader->leader;
    created.token = leader->token;
  }
  directory_.forget(name);
  return Created{std::move(created), false};
}

absl::StatusOr<ScenePtr> ClusterScenes::wait_for(const std::string& name, steady_clock::time_point deadline) {
  const steady_clock::time_point until = std::min(deadline, steady_clock::now() + kWait);
  bool asked = false;
  while (true) {
    absl::StatusOr<ScenePtr> scene = host_.registry.find_scene(name);
    if (!absl::IsNotFound(scene.status())) return scene;
    absl::Status why = missing(name);
    if (absl::IsNotFound(why) && !std::exchange(asked, true)) {
      // Another member may have acknowledged the creation after this one had asked.
      RETURN_IF_ERROR(directory_.look_up(name).status());
      continue;
    }
    if (!absl::IsUnavailable(why) || steady_clock::now() >= until) return why;
    std::this_thread::sleep_for(kPoll);
  }
}

absl::Status ClusterScenes::missing(const std::string& name) {
  ASSIGN_OR_RETURN(const std::optional<CatalogueScene> row, directory_.known(name));
  return row ? elsewhere(*row) : no_scene(name);
}

absl::Status ClusterScenes::elsewhere(const CatalogueScene& row) {
  const MemberId self = member_.id();
  if (row.member != 0 && row.member == self) {
    if (!leads(row.key)) member_.look_soon();  // this caller knows it before this daemon's next beat
    return being_read(row.name);
  }
  Refusal refusal;
  refusal.reason = Reason::kElsewhere;
  refusal.field = "scene";
  refusal.token = row.token;
  if (row.member != 0) refusal.addresses = {directory_.address_of(row.member)};
  // The own address belongs to an earlier run of this daemon, which is not declared dead yet.
  if (row.member == 0 || refusal.addresses.front().empty() || refusal.addresses.front() == address_)
    return no_leader(absl::StrCat("no server leads the scene '", row.name, "' at present"), kNoLeaderMs);
  return refuse(absl::StatusCode::kFailedPrecondition,
                absl::StrCat("another server has the scene '", row.name, "'; call ", refusal.addresses.front()),
                refusal);
}

absl::Status ClusterScenes::remove(const std::string& name) {
  const auto [key, led] = find_led(name);
  if (led.lease == nullptr) {
    const absl::StatusOr<ScenePtr> found = wait_for(name);
    return found.ok() || absl::IsDataLoss(found.status()) ? being_read(name) : found.status();
  }
  const bool logged = led.scene == nullptr || led.scene->log_key() != 0;
  absl::Status status = logged ? host_.registry.delete_scene(name) : log_.delete_scene(key);
  // The leadership has ended meanwhile.
  if (absl::IsAborted(status) || absl::IsNotFound(status))
    status = no_leader("the leadership of the scene has ended here", kReadingMs);
  RETURN_IF_ERROR(status);
  if (!logged) {
    led.scene->close();
    host_.registry.drop_scene(led.scene);
  }
  directory_.forget(name);
  end_deleted(key, *led.lease);
  return absl::OkStatus();
}

void ClusterScenes::deleted(const Scene& scene) {
  const SceneKey key = key_of(scene);
  const std::shared_ptr<const SceneLease> lease = lease_of(scene);
  if (key == 0 || lease == nullptr) return;
  if (scene.log_key() == 0) {
    const absl::Status removed = log_.delete_scene(key);
    if (!removed.ok())
      log(LogLevel::kWarning, "an idle scene could not be deleted in the engine; it begins anew",
          {{"scene", scene.name()}, {"why", std::string(removed.message())}});
  }
  directory_.forget(scene.name());
  end_deleted(key, *lease);
}

void ClusterScenes::end_deleted(SceneKey key, const SceneLease& lease) {
  {
    const MutexLock lock(mutex_);
    const auto found = led_.find(key);
    if (found != led_.end() && found->second.lease.get() == &lease) found->second.deleted = true;
  }
  member_.fenced(key, lease.token());
}

absl::Status ClusterScenes::store_settings(const Scene& scene) {
  const SceneKey key = key_of(scene);
  SceneSpec spec = scene.spec();
  const SceneSettings settings = scene.settings();
  spec.labels = settings.labels;
  spec.cell_size = settings.cell_size;
  const absl::Status stored = key == 0 ? absl::AbortedError("") : log_.set_scene_spec(key, encode_spec(spec));
  if (absl::IsAborted(stored)) return no_leader("the leadership of the scene has ended here", kReadingMs);
  return stored;
}

absl::StatusOr<v1::MoveSceneResponse> ClusterScenes::move(const std::string& name, const std::string& to,
                                                          steady_clock::time_point deadline) {
  const auto [key, led] = find_led(name);
  if (led.lease == nullptr) return missing(name);
  const MemberId self = member_.id();
  std::vector<MemberRow> others = directory_.members();
  std::erase_if(others, [&](const MemberRow& row) {
    return row.id == self || row.info.address == address_ ||
           (to.empty() ? row.load >= kTakesNoScenes : row.info.address != to);
  });
  if (others.empty()) {
    Refusal refusal;
    refusal.reason = Reason::kNotFound;
    refusal.field = "to";
    return refuse(absl::StatusCode::kNotFound,
                  to.empty() ? "the cluster has no other member that takes scenes"
                             : absl::StrCat("no other member of the cluster has the address '", to, "'"),
                  refusal);
  }
  const auto least = std::min_element(others.begin(), others.end(),
                                      [](const MemberRow& a, const MemberRow& b) { return a.load < b.load; });
  absl::Status moved = member_.move(key, least->id, deadline);
  if (absl::IsAborted(moved) || absl::IsNotFound(moved))
    moved = no_leader("the leadership of the scene has ended here meanwhile", kReadingMs);
  RETURN_IF_ERROR(moved);
  v1::MoveSceneResponse response;
  response.set_leader(least->info.address);
  response.set_token(led.lease->token() + 1);
  return response;
}

uint64_t ClusterScenes::load() {
  uint64_t load = 0;
  const MutexLock lock(mutex_);
  for (const auto& [key, led] : led_)
    load += kSceneLoad + (led.scene == nullptr ? 0 : led.scene->latest()->objects.size());
  return load;
}

void ClusterScenes::start_leading(const LedScene& scene) {
  {
    const MutexLock lock(mutex_);
    led_[scene.row.key] = Led{scene.lease, "", nullptr, false};
    leaving_.erase(scene.row.key);
  }
  ++begun_;
  submit(scene.row.key, [this, scene] { read(scene); });
}

void ClusterScenes::stop_leading(SceneKey key, Token token, StopReason reason) {
  Led stopped;
  {
    const MutexLock lock(mutex_);
    const auto found = led_.find(key);
    if (found == led_.end() || found->second.lease->token() != token) return;
    stopped = std::move(found->second);
    led_.erase(found);
    if (stopped.scene != nullptr) {
      keys_.erase(stopped.scene.get());
      stopped.scene->close(no_leader("the leadership of the scene has ended here", kReadingMs));
      host_.registry.drop_scene(stopped.scene);
    }
    if (!stopped.name.empty() && stopped.scene == nullptr) host_.registry.drop_damaged_scene(stopped.name, key);
    if (!stopped.name.empty() && reason == StopReason::kHandedOver) leaving_[key] = stopped.name;
  }
  if (reason == StopReason::kFenced && !stopped.deleted) ++fenced_;
  if (stopped.name.empty()) return;
  directory_.forget(stopped.name);
  if (stopped.scene != nullptr) {
    // A change that began before the scene was closed may still append. The next leadership of this daemon reads the
    // scene after it.
    submit(key, [scene = stopped.scene] { scene->await_changes(); });
    host_.changes.forget(stopped.scene->latest()->epoch);
    host_.idle_scenes.forget(*stopped.scene);
    host_.leases.forget(*stopped.scene);
  }
  log(LogLevel::kInfo, "scene is not led any more",
      {{"scene", stopped.name},
       {"token", absl::StrCat(token)},
       {"why", reason == StopReason::kFenced         ? "another member leads it, or it was deleted"
               : reason == StopReason::kDeclaredDead ? "this member was declared dead"
                                                     : "it is handed over"}});
}

void ClusterScenes::leader_changed(const LeaderRow& row) {
  CatalogueScene scene;
  {
    const MutexLock lock(mutex_);
    const auto left = leaving_.find(row.key);
    if (left == leaving_.end()) return;
    scene.name = std::move(left->second);
    leaving_.erase(left);
  }
  scene.key = row.key;
  scene.epoch = row.epoch;
  scene.member = row.leader;
  scene.token = row.token;
  scene.last_sequence = row.last_sequence;
  directory_.store(scene.name, scene, steady_clock::now());  // callers are told at once
  log(LogLevel::kInfo, "scene has a new leader",
      {{"scene", scene.name}, {"member", absl::StrCat(row.leader)}, {"token", absl::StrCat(row.token)}});
}

void ClusterScenes::read(const LedScene& led) {
  const auto current = [&] { return !ended_ && led.lease->state() != SceneLease::State::kStopped; };
  if (!current()) return;
  const steady_clock::time_point start = steady_clock::now();
  std::string name;
  const absl::StatusOr<ScenePtr> scene = read_once(led, name);
  if (scene.ok() || (absl::IsDataLoss(scene.status()) && !name.empty())) {
    publish(led, name, scene.ok() ? *scene : nullptr, scene.status());
    log(scene.ok() ? LogLevel::kInfo : LogLevel::kError, scene.ok() ? "scene is led" : "scene is damaged",
        {{"scene", name},
         {"token", absl::StrCat(led.lease->token())},
         {"milliseconds", absl::StrCat(std::chrono::duration_cast<milliseconds>(steady_clock::now() - start).count())},
         {"why", std::string(scene.status().message())}});
    return;
  }
  const bool fenced = absl::IsAborted(scene.status()) || absl::IsNotFound(scene.status());
  if (fenced && member_.fenced(led.row.key, led.lease->token())) return;
  if (!fenced)
    log(LogLevel::kWarning, "a scene could not be read; this is tried again",
        {{"scene", absl::StrCat(led.row.key, name.empty() ? "" : " ", name)},
         {"why", std::string(scene.status().message())}});
  // Other scenes are read meanwhile, for which this thread pauses only a moment.
  std::this_thread::sleep_for(kReadAgain);
  if (current()) submit(led.row.key, [this, led] { read(led); });
}

absl::StatusOr<ScenePtr> ClusterScenes::read_once(const LedScene& led, std::string& name) {
  ASSIGN_OR_RETURN(StoredScene stored, log_.begin_leading(led.row.key, led.row.leader, led.lease->token()));
  name = stored.name;
  RETURN_IF_ERROR(stored.damage);
  ASSIGN_OR_RETURN(SceneSpec spec, decode_spec(stored.spec));
  spec.pinned_bytes = host_.pinned_limit();
  stored.spec = encode_spec(spec);
  const bool in_memory = spec.durability == Durability::kMemory;
  if (in_memory) {
    stored.epoch = new_epoch();
    RETURN_IF_ERROR(log_.restart_scene(stored.key, stored.epoch));
  }
  // Meshes are not read while the scene is, because both would need a connection to the engine at once. The scene is
  // read again when the meshes that were not in memory have been read.
  std::set<MeshKey> asked;
  while (true) {
    std::set<MeshKey> missing;
    const FindMesh find = [&](const MeshKey& key) -> MeshPtr {
      MeshPtr mesh = host_.registry.find_stored(key);
      if (mesh == nullptr && !asked.contains(key)) missing.insert(key);
      return mesh;
    };
    absl::StatusOr<ScenePtr> scene =
        recover_scene(log_, stored, find, nullptr, in_memory ? LogUse::kReadOnly : LogUse::kAppend);
    if (missing.empty() || (!scene.ok() && !absl::IsDataLoss(scene.status()))) return scene;
    for (const MeshKey& key : missing) {
      const absl::Status read = host_.cluster_meshes->refresh(key.name, "mesh").status();
      // A mesh that is not stored any more was used by earlier records only; recover_scene() checks that.
      if (!absl::IsNotFound(read) && !absl::IsDataLoss(read)) RETURN_IF_ERROR(read);
      asked.insert(key);
    }
  }
}

void ClusterScenes::publish(const LedScene& led, const std::string& name, const ScenePtr& scene,
                            const absl::Status& damage) {
  {
    const MutexLock lock(mutex_);
    const auto found = led_.find(led.row.key);
    if (found == led_.end() || found->second.lease != led.lease) return;
    found->second.name = name;
    found->second.scene = scene;
    if (scene == nullptr) {
      host_.registry.restore_damaged_scene(name, led.row.key, damaged_data("scene", damage));
      return;
    }
    host_.registry.restore_scene(scene);
    keys_[scene.get()] = led.row.key;
  }
  host_.idle_scenes.watch(scene);
  host_.leases.watch(scene);
  host_.mesh_collector.instances_changed(*scene);
  if (!scene->latest()->statics->meshes().empty()) host_.cluster_meshes->release_unused(*scene);
}

SceneKey ClusterScenes::key_of(const Scene& scene) const {
  const MutexLock lock(mutex_);
  const auto found = keys_.find(&scene);
  return found == keys_.end() ? 0 : found->second;
}

std::shared_ptr<const SceneLease> ClusterScenes::lease_of(const Scene& scene) const {
  const MutexLock lock(mutex_);
  const auto found = keys_.find(&scene);
  return found == keys_.end() ? nullptr : led_.at(found->second).lease;
}

uint32_t ClusterScenes::age_ms(const Scene& scene) const {
  const std::shared_ptr<const SceneLease> lease = lease_of(scene);
  if (lease == nullptr || lease->member().expires() == ClusterTime::min()) return std::numeric_limits<uint32_t>::max();
  if (lease->living()) return 0;
  // The last beat that succeeded, at which this daemon led the scene, was sent this long ago.
  const auto age = clock_() - (lease->member().expires() - timing_.lease);
  const auto whole = std::chrono::ceil<milliseconds>(age).count();
  return static_cast<uint32_t>(std::clamp<int64_t>(whole, 0, std::numeric_limits<uint32_t>::max()));
}

absl::StatusOr<uint32_t> ClusterScenes::check_view(const Scene& scene, const v1::View& view) const {
  const uint32_t age = age_ms(scene);
  const bool too_old = age != 0 && (view.leader_only() || (view.max_age_ms() != 0 && age > view.max_age_ms()));
  if (!too_old) return age;
  return no_leader(absl::StrCat("this server cannot know whether it still leads the scene '", scene.name(), "'"),
                   kNoLeaderMs);
}

v1::ScenePlacement ClusterScenes::placement_of(const Scene& scene) const {
  v1::ScenePlacement placement;
  const std::shared_ptr<const SceneLease> lease = lease_of(scene);
  placement.set_role(lease != nullptr && lease->living() ? v1::SCENE_ROLE_LEADING : v1::SCENE_ROLE_NO_LEADER);
  placement.set_leader(address_);
  if (lease != nullptr) placement.set_token(lease->token());
  return placement;
}

v1::ScenePlacement ClusterScenes::placement_of(const CatalogueScene& row) const {
  v1::ScenePlacement placement;
  placement.set_token(row.token);
  placement.set_leader(directory_.address_of(row.member));
  placement.set_role(row.member != 0 && row.member == member_.id() ? v1::SCENE_ROLE_CATCHING_UP
                     : placement.leader().empty()                  ? v1::SCENE_ROLE_NO_LEADER
                                                                   : v1::SCENE_ROLE_ELSEWHERE);
  return placement;
}

v1::Cluster ClusterScenes::describe() {
  v1::Cluster cluster;
  for (const MemberRow& row : directory_.known_members()) {
    v1::ClusterMember& member = *cluster.add_members();
    member.set_id(row.id);
    member.set_address(row.info.address);
    member.set_zone(row.info.zone);
    member.set_version(row.info.version);
    member.set_draining(row.load >= kTakesNoScenes);
    if (!member.draining()) member.set_load(row.load);
  }
  cluster.set_member(member_.id());
  cluster.set_engine(engine_hosts_);
  cluster.set_engine_answers(member_.engine_answers());
  cluster.set_leading(static_cast<uint32_t>(member_.leading()));
  return cluster;
}

ClusterScenes::Figures ClusterScenes::figures() {
  Figures figures{member_.leading(), begun_.load(), fenced_.load(), member_.engine_answers(), 0, {}};
  figures.members = directory_.known_members().size();
  appends_.add_to(figures.appends);
  return figures;
}

void ClusterScenes::write_snapshots(steady_clock::time_point deadline) {
  for (const ScenePtr& scene : host_.registry.list_scenes("", std::numeric_limits<size_t>::max())) {
    if (steady_clock::now() >= deadline || !member_.engine_answers()) return;
    const LogPosition position = scene->log_position();
    if (scene->log_key() == 0 || position.sequence == position.snapshot_sequence) continue;
    const FrozenScene frozen = scene->freeze();
    const uint64_t sequence = frozen.sequence, bytes = frozen.log_bytes;
    StateWriter state(frozen);
    if (log_.write_snapshot(scene->log_key(), sequence, [&state] { return state.next(); }).ok())
      scene->snapshot_written(sequence, bytes);
  }
}

void ClusterScenes::drain(steady_clock::time_point deadline) {
  if (!started_) return;
  const steady_clock::time_point now = steady_clock::now();
  write_snapshots(now + (deadline - now) / 2);
  const bool left = member_.drain(deadline);
  log(left ? LogLevel::kInfo : LogLevel::kWarning,
      left ? "left the cluster" : "the scenes could not be handed over in time; others take them over within seconds");
}

}  // namespace locus::server
