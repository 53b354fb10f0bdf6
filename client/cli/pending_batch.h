// Update batch that collects the changes of several lines of a script, so that they become one revision. For the
// commands `begin` and `commit` and the lines between them. Not thread-safe.
//
// Invariant: the batch has the same effect as running its lines one by one. The server applies removes, then inserts,
// then moves, then relabels. Therefore the lines that change one object must be in this order, and add() refuses a line
// that breaks the order.
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

  // Adds the changes of one line of the script. Returns a usage error, and adds nothing, in these cases: the line names
  // a scene other than scene(); it sets a tick; its inserts differ from earlier inserts in `upsert`; it has a frame; it
  // has a change that the server would apply before an earlier line's change of the same object. A removal of all
  // objects or of a group counts as a change of every object.
  absl::Status add(const std::string& scene, const v1::UpdateBatch& line);

  // Returns the scene that all lines name; empty before the first add().
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
  std::map<uint64_t, Step> last_step_;  // last kind of change to each id so far
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_PENDING_BATCH_H_
