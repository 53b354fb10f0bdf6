// Encodes a scene's state in chunks. The state is an immutable snapshot, so the scene may change meanwhile. The chunks
// are encoded one at a time, so only one chunk is in memory. One thread at a time.
//
// The first chunk is a header with the numbers of writers, instances, objects, expiries and leases. The chunks of
// writers follow, then the chunks of instances, of compounds, of objects, of expiries and of leases. The objects are in
// the order of the grid. StateReader (core/scene/log/state_reader.h) decodes the chunks; FORMAT.md describes the bytes.
#ifndef LOCUS_CORE_SCENE_LOG_STATE_WRITER_H_
#define LOCUS_CORE_SCENE_LOG_STATE_WRITER_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "core/scene/log/scene_state.h"
#include "core/scene/log/update_log.h"

namespace locus {

class StateWriter {
 public:
  explicit StateWriter(FrozenScene scene);

  // Returns the next chunk, of at most UpdateLog::kMaxChunkBytes bytes, or nullopt at the end. May be passed to
  // UpdateLog as a ChunkSource.
  absl::StatusOr<std::optional<std::string>> next();
  // Returns the size in bytes of all chunks that next() has returned.
  uint64_t bytes() const { return bytes_; }

 private:
  const CompoundArray* compounds() const { return scene_.snapshot->objects.compounds(); }
  std::string header() const;
  std::string next_writers();
  std::string next_instances();
  std::string next_compounds();
  std::string next_objects();
  std::string next_expiries();
  std::string next_leases();

  const FrozenScene scene_;
  const std::vector<WriterTable::Writer> writers_;
  bool begun_ = false;
  size_t next_writer_ = 0;
  Bvh<Instance>::Values::Iterator next_instance_, last_instance_;
  uint64_t compound_count_ = 0;
  size_t next_compound_ = 0;  // index in ObjectSet::compounds()
  // Number of each compound that was written, in the order of writing.
  absl::flat_hash_map<const Compound*, uint32_t> compound_numbers_;
  size_t objects_written_ = 0;
  GridCursor next_object_;
  bool names_messages_ = false;  // an ack has an error of a message other than the first
  size_t expiries_written_ = 0;
  GridCursor next_expiry_;  // next object whose expiry is written, if it expires
  size_t next_lease_ = 0;
  std::vector<Id> leased_;  // ids of the objects of the lease next_lease_ that are not written yet
  uint64_t bytes_ = 0;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_STATE_WRITER_H_
