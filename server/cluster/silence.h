// Measures for how long the members that this member watches have been silent: for how long the engine has shown the
// same beat of them. Time counts only while the own beats succeed one after another. An engine that is away, or a pause
// of this process, therefore begins all measurements anew, and declares nobody dead. Only times of this process's clock
// are compared: silence begins when a beat is first seen, which is after its member sent it.
//
// Threads: one thread at a time. Cost of each member function: the number of watched members.
#ifndef LOCUS_SERVER_CLUSTER_SILENCE_H_
#define LOCUS_SERVER_CLUSTER_SILENCE_H_

#include <optional>

#include "absl/container/flat_hash_map.h"
#include "absl/types/span.h"
#include "server/cluster/cluster_engine.h"
#include "server/cluster/cluster_timing.h"

namespace locus::server {

class SilenceCounter {
 public:
  explicit SilenceCounter(const ClusterTiming& timing) : timing_(timing) {}

  // Records that an own beat succeeded, whose answer, with the beats `seen` of the watched members, came at `received`.
  // Members that are not in `seen` are not watched any more.
  void beat_succeeded(ClusterTime received, absl::Span<const SeenBeat> seen);
  // Records that an own beat failed.
  void beat_failed();
  // Begins the measurement of a member anew, because it turned out to be living.
  void restart(MemberId id, ClusterTime now);
  void remove(MemberId id) { watched_.erase(id); }
  void clear();

  // Returns a member that has been silent for `timing.silence`, with its beat, or nullopt.
  std::optional<SeenBeat> silent(ClusterTime now) const;
  // Returns the first time at which silent() may return a member if no further beat is seen, or ClusterTime::max() if
  // only a further beat can make it do so.
  ClusterTime next(ClusterTime now) const;
  // Returns the number of members that have been silent for `timing.quiet`.
  size_t quiet(ClusterTime now) const;

 private:
  struct Watched {
    uint64_t beat = 0;
    ClusterTime since;  // time at which this beat was first seen
  };

  // Returns true if the last own beat is too long ago for silence of others to count.
  bool stale(ClusterTime now) const { return !last_success_ || now - *last_success_ > timing_.max_gap; }

  const ClusterTiming timing_;
  absl::flat_hash_map<MemberId, Watched> watched_;
  std::optional<ClusterTime> last_success_;  // of the own beats, unless the last one failed
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CLUSTER_SILENCE_H_
