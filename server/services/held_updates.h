// Messages of an update stream that belong to one revision (UpdateBatch.continues) and wait for the last message. The
// stream owns its HeldUpdates, so that a stream that ends drops them. Columns are not copied: the messages themselves
// are kept, together with their claims of memory.
//
// A refused message drops all messages that are held. Until the last message of the same revision has arrived, all
// further messages are refused, too. Threads: one at a time, the call's IO loop.
#ifndef LOCUS_SERVER_SERVICES_HELD_UPDATES_H_
#define LOCUS_SERVER_SERVICES_HELD_UPDATES_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "core/scene/registry.h"
#include "core/scene/updates/update_batch.h"
#include "locus/v1/update_service.pb.h"
#include "server/rpc/call_memory.h"

namespace locus::server {

class HeldUpdates {
 public:
  // Messages of one revision, all except the last.
  struct Messages {
    std::vector<UpdateBatch> batches;                            // borrow their columns from `owners`
    std::vector<std::unique_ptr<const v1::UpdateBatch>> owners;  // one for each batch
    std::vector<CallMemory> claims;                              // for the messages and for applying them
    std::weak_ptr<Scene> scene;                                  // scene of the first message
  };

  // Returns the error of a message if an earlier message of the same revision was refused.
  absl::Status check_not_refused() const;
  // Returns an error if the message is about another scene than the held ones: the scene was deleted, and another one
  // was created under its name.
  absl::Status check_scene(const ScenePtr& scene) const;
  // Returns an error if `batch` and the held messages together exceed a limit.
  absl::Status check_limits(const UpdateBatch& batch) const;

  // Holds a message. Precondition: the checks above have returned OK. `batch` borrows its columns from `owner`.
  void hold(const ScenePtr& scene, UpdateBatch batch, std::unique_ptr<const v1::UpdateBatch> owner,
            std::vector<CallMemory> claims);
  // Returns the number of items of the held messages.
  uint64_t items() const { return items_; }
  // The writer of the last batch of the stream, 0 if it has none. A message that is held does not name its writer; it
  // is taken to be the writer of the batch before.
  uint64_t writer() const { return writer_; }
  void set_writer(uint64_t writer) { writer_ = writer; }
  // Gives away the held messages; then none is held.
  Messages take();
  // Drops the held messages, because a message was refused. `continues` is whether that message continues: then the
  // next message belongs to the same revision and is refused as well.
  void refuse_rest(bool continues);

 private:
  Messages messages_;
  uint64_t items_ = 0;
  uint64_t lists_ = 0;
  uint64_t writer_ = 0;
  bool refused_ = false;  // a message of the revision to which the next message belongs was refused
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_HELD_UPDATES_H_
