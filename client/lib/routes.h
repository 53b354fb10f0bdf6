// Knowledge of a client of a cluster: which server leads each scene, which servers have just failed, and the highest
// revision that was seen of each scene. Internal to the library; makes no call.
//
// Thread-safe. Invariants: of two answers about the leader of a scene, the one with the higher token is kept, as long
// as its server answers. The number of scenes and of addresses that are kept is bounded.
#ifndef LOCUS_CLIENT_LIB_ROUTES_H_
#define LOCUS_CLIENT_LIB_ROUTES_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "client/lib/options.h"
#include "client/lib/values.h"
#include "locus/v1/cluster.pb.h"
#include "locus/v1/errors.pb.h"

namespace locus::client {

class Routes {
 public:
  // Maximum numbers of scenes that are kept, and of addresses that errors have named.
  static constexpr size_t kMaxScenes = 10'000;
  static constexpr size_t kMaxLearned = 64;

  using Clock = std::function<absl::Time()>;

  // `given` are the targets that the user gave, at least one; each once.
  Routes(std::vector<std::string> given, Clock clock);

  const std::vector<std::string>& given() const { return given_; }
  // Returns the given targets, then those that servers have named.
  std::vector<std::string> all() const;

  // Returns the target to call next about a scene: its leader or, if that is not known or has failed, another server,
  // which names the leader.
  std::string next(absl::string_view scene) const;
  // Returns false if the server has just failed.
  bool would_answer(const std::string& target) const;
  // Notes that a server answers.
  void answered(const std::string& target);
  // Notes that a server cannot be reached, starts or shuts down.
  void failed(const std::string& target);
  // Notes that the server at `target` does not lead the scene for the time `pause`, although it may be said to.
  void has_no_leader(absl::string_view scene, const std::string& target, absl::Duration pause);
  // Notes the leader of a scene, as the server at `teller` named it in an error with REASON_ELSEWHERE. An answer with
  // an older token is ignored, unless the known leader has failed or is the teller itself: then the scene may have been
  // deleted and created anew, with tokens from 1.
  void elsewhere(absl::string_view scene, const std::string& teller, const v1::Error& error);
  // Forgets who leads a scene, which a server does not know.
  void forget_leader(absl::string_view scene);
  // Forgets everything about a scene, which was deleted.
  void forget(absl::string_view scene);

  // Returns the target that was chosen for queries about a scene, or another of its readers if that has failed. Returns
  // nothing if the followers must be asked for again; an empty target if there is none.
  std::optional<std::string> reader(absl::string_view scene);
  // Chooses the server for queries about a scene among those of its placement. `placement`: null if the leader did not
  // answer; then the readers stay as they are.
  void set_readers(absl::string_view scene, const v1::ScenePlacement* placement, ReadFrom read_from);
  void forget_readers(absl::string_view scene);

  // Returns the highest revision that was seen of a scene.
  std::optional<Revision> floor(absl::string_view scene) const;
  // Notes a revision that was seen. Only the leader can show that a scene has another epoch than the known one.
  void saw(absl::string_view scene, const Revision& revision, bool from_leader);

 private:
  struct Leader {
    std::string target;
    uint64_t token = 0;
    absl::Time paused_until = absl::InfinitePast();
  };
  struct Readers {
    std::vector<std::string> targets;
    std::string chosen;
    absl::Time ask_again_at;
  };
  template <class Value>
  using ByScene = std::map<std::string, Value, std::less<>>;

  // Precondition of the functions below: the caller holds the lock.
  std::vector<std::string> every() const;
  bool has_failed(const std::string& target) const;
  void move_on_from(const std::string& target);
  void learn(const std::string& target);

  const std::vector<std::string> given_;
  const Clock clock_;
  mutable std::mutex mutex_;
  std::vector<std::string> learned_;
  size_t current_ = 0;  // index of the server that is asked about a scene whose leader is not known
  std::map<std::string, absl::Time> failed_until_;
  ByScene<Leader> leaders_;
  ByScene<Readers> readers_;
  ByScene<Revision> floors_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_ROUTES_H_
