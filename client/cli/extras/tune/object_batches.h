// The objects of a scene at one revision, as batches that insert them into a scratch scene. For `locus tune`. A class
// that is filled once, and then only read.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TUNE_OBJECT_BATCHES_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TUNE_OBJECT_BATCHES_H_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/lib/client.h"
#include "core/base/progress_writer.h"

namespace locus::cli {

class ObjectBatches {
 public:
  // Dumps the scene. A batch has at most `max_bytes` bytes, or one message of the dump if that is larger. Returns the
  // errors of the dump.
  absl::Status dump(const client::Client& client, const std::string& scene, uint64_t max_bytes,
                    ProgressWriter& progress);

  const std::vector<v1::UpdateBatch>& batches() const { return batches_; }
  // Returns the instances of the revision, as the dump sends them.
  const std::vector<v1::Placement>& instances() const { return instances_; }
  uint64_t objects() const { return objects_; }
  uint64_t revision() const { return revision_; }
  // Returns a batch that moves the first object by 1 along x or, if not `away`, back to its place. Precondition: there
  // is an object.
  v1::UpdateBatch move_first(bool away) const;
  // Returns the positions of up to `count` objects, evenly spaced in the order of ids.
  std::vector<std::array<double, 3>> positions(uint64_t count) const;

 private:
  std::vector<v1::UpdateBatch> batches_;
  std::vector<v1::Placement> instances_;
  uint64_t objects_ = 0;
  uint64_t revision_ = 0;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TUNE_OBJECT_BATCHES_H_
