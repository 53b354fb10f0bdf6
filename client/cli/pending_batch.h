// Update batch that collects the changes of several lines, so that they become one revision. For `begin` ... `commit`
// in scripts and the commands between them. Not thread-safe.
//
// Invariant: the batch has the same effect as its lines run one by one. The server applies removes, then inserts, then
// moves, then relabels, so the lines about one object must come in that order; others are refused.
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

  // Adds the changes of a line. Returns a usage error, and adds nothing, if the line names another scene or a tick,
  // differs in upsert, has float positions in a frame, or has a change that the server would apply in another order.
  absl::Status add(const std::string& scene, const v1::UpdateBatch& line);

  // Returns the scene of the lines; empty before the first add().
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
  std::map<uint64_t, Step> last_step_;  // last step of each id named so far
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_PENDING_BATCH_H_
