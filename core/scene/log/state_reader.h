// Decodes a scene's state from the chunks that StateWriter wrote. Validates everything: DATA_LOSS describes damage. One
// thread at a time.
#ifndef LOCUS_CORE_SCENE_LOG_STATE_READER_H_
#define LOCUS_CORE_SCENE_LOG_STATE_READER_H_

#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/scene/log/byte_codec.h"
#include "core/scene/log/scene_state.h"

namespace locus {

// Returns the mesh of that name and content, or null. Without a name (format 1), any mesh of that content.
using FindMesh = std::function<std::shared_ptr<const StaticMesh>(const MeshKey&)>;

class StateReader {
 public:
  // Reads the next chunk, in the order in which they were written.
  absl::Status add(absl::string_view chunk);
  // Makes the state after all chunks were added, and builds the tree of instances. DATA_LOSS if chunks are missing or
  // `find_mesh` does not find a mesh.
  absl::StatusOr<SceneState> finish(const FindMesh& find_mesh) &&;

 private:
  // Placements of one mesh.
  struct Placed {
    std::vector<uint64_t> ids, groups, tags;
    std::vector<uint32_t> layers;
    std::vector<double> translations;
    std::vector<float> rotations, scales;
  };
  void read_header(ByteReader& reader);
  void read_writers(ByteReader& reader);
  void read_instances(ByteReader& reader, BytesKind kind);
  void read_objects(ByteReader& reader);
  absl::Status place(const FindMesh& find_mesh);

  SceneState state_;
  bool begun_ = false;
  uint64_t writers_ = 0;  // expected counts, from the header
  uint64_t instances_ = 0;
  uint64_t objects_ = 0;
  uint64_t instances_read_ = 0;
  uint64_t objects_read_ = 0;
  std::map<MeshKey, Placed> placed_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_STATE_READER_H_
