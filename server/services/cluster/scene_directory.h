// Knowledge about scenes that this daemon does not have: which member leads each, and at which address. Entries are
// read from the engine when a caller asks for a scene, and are at most kFresh old when they answer NOT_FOUND; an older
// entry about a leader may still answer, because that member knows a newer one.
//
// Threads: every member function may be called from any thread. known() never waits; one thread of this object reads
// the entries for it. look_up() and members() wait for the engine. Invariants: at most kMaxEntries entries and
// kMaxAsked waiting names, whatever names callers ask for.
#ifndef LOCUS_SERVER_SERVICES_CLUSTER_SCENE_DIRECTORY_H_
#define LOCUS_SERVER_SERVICES_CLUSTER_SCENE_DIRECTORY_H_

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "server/cluster/cluster_engine.h"
#include "server/storage/postgres_log.h"

namespace locus::server {

class SceneDirectory {
 public:
  // Age up to which an entry is used without reading it again, and up to which one says that a scene does not exist or
  // has no leader.
  static constexpr std::chrono::milliseconds kFresh{50};
  // Age up to which the list of members is used without reading it again.
  static constexpr std::chrono::milliseconds kFreshMembers{500};
  static constexpr size_t kMaxEntries = 65'536;
  static constexpr size_t kMaxAsked = 4'096;

  // `log` and `engine` must outlive this object.
  SceneDirectory(const PostgresLog& log, ClusterEngine& engine);
  ~SceneDirectory();
  SceneDirectory(const SceneDirectory&) = delete;
  SceneDirectory& operator=(const SceneDirectory&) = delete;

  // Returns the scene, or nullopt if no scene has the name.
  absl::StatusOr<std::optional<CatalogueScene>> look_up(const std::string& name) LOCUS_EXCLUDES(mutex_);
  // Returns what is known of the scene without waiting: UNAVAILABLE, NO_LEADER, if that is nothing or too old; then the
  // scene is being looked up.
  absl::StatusOr<std::optional<CatalogueScene>> known(const std::string& name) LOCUS_EXCLUDES(mutex_);
  // Records what another source said of the scene at `asked` or later. Older news than what is known has no effect.
  void store(const std::string& name, const std::optional<CatalogueScene>& scene,
             std::chrono::steady_clock::time_point asked) LOCUS_EXCLUDES(mutex_);
  // Makes the next known() look the scene up.
  void forget(const std::string& name) LOCUS_EXCLUDES(mutex_);

  // Returns the living members, at most kFreshMembers old; older ones if the engine does not answer.
  std::vector<MemberRow> members() LOCUS_EXCLUDES(mutex_);
  // Returns the living members as last read, without waiting, and begins to read them again if they are older than
  // kFreshMembers.
  std::vector<MemberRow> known_members() LOCUS_EXCLUDES(mutex_);
  // Returns the address of a living member as last read, without waiting; empty if it is not known.
  std::string address_of(MemberId member) const LOCUS_EXCLUDES(mutex_);

 private:
  using Time = std::chrono::steady_clock::time_point;
  struct Entry {
    std::optional<CatalogueScene> scene;
    Time read;       // when the answer came; min(): not read since forget()
    Time forgotten;  // answers of questions that were asked before are too old
  };

  void run() LOCUS_EXCLUDES(mutex_);
  // Reads the members if the list is older than kFreshMembers or lacks `wanted`.
  void refresh_members(MemberId wanted) LOCUS_EXCLUDES(mutex_);
  void ask(const std::string& name) LOCUS_REQUIRES(mutex_);

  const PostgresLog& log_;
  ClusterEngine& engine_;
  mutable Mutex mutex_;
  ConditionVariable asked_soon_;
  absl::flat_hash_map<std::string, Entry> entries_ LOCUS_GUARDED_BY(mutex_);
  std::deque<std::string> asked_ LOCUS_GUARDED_BY(mutex_);             // names to look up, each once
  absl::flat_hash_set<std::string> waiting_ LOCUS_GUARDED_BY(mutex_);  // the names in asked_
  std::vector<MemberRow> members_ LOCUS_GUARDED_BY(mutex_);
  std::optional<Time> members_read_ LOCUS_GUARDED_BY(mutex_);
  bool members_asked_ LOCUS_GUARDED_BY(mutex_) = true;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last, because it uses the other members
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_CLUSTER_SCENE_DIRECTORY_H_
