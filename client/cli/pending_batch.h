// Changes of several lines that become one update batch and so one revision. For `begin` ... `commit` of scripts and
// the commands between them. Not thread-safe.
//
// A batch removes first, then inserts, then moves. Lines are taken only where that gives what running them one after
// another would: about one object they come in that order. So a batch means what its lines say.
#ifndef LOCUS_CLIENT_CLI_PENDING_BATCH_H_
#define LOCUS_CLIENT_CLI_PENDING_BATCH_H_

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "client/lib/client.h"

namespace locus::cli {

class PendingBatch {
 public:
  explicit PendingBatch(std::optional<uint64_t> tick) {
    if (tick) batch_.set_tick(*tick);
  }

  // Adds what a line changes. A usage error, and nothing is added, for another scene than before, a tick of its own, a
  // second opinion on upsert, float positions in a frame, or a change that the batch would make in another order.
  absl::Status add(const std::string& scene, const v1::UpdateBatch& line);

  // Empty if nothing was added.
  const std::string& scene() const { return scene_; }
  const v1::UpdateBatch& batch() const { return batch_; }

 private:
  enum class Step { kRemove, kInsert, kMove, kRelabel };

  absl::Status check_order(const v1::UpdateBatch& line) const;
  absl::Status check_ids(const v1::UpdateBatch& line) const;
  absl::Status check_step(uint64_t id, Step step) const;
  void remember(const v1::UpdateBatch& line);

  std::string scene_;
  v1::UpdateBatch batch_;
  std::map<uint64_t, Step> last_step_;  // of each id named so far
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_PENDING_BATCH_H_
