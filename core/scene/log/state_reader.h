// Decodes a scene's state from the chunks that StateWriter wrote. Validates everything and returns DATA_LOSS, with a
// description, if a chunk is damaged. One thread at a time.
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

// Function that returns the mesh with the name and content of a key, or null if there is no such mesh. If the key has
// no name, because it was stored in data format 1, the function may return any mesh of the content.
using FindMesh = std::function<std::shared_ptr<const StaticMesh>(const MeshKey&)>;

class StateReader {
 public:
  // Decodes the next chunk. The chunks must be added in the order in which they were written.
  absl::Status add(absl::string_view chunk);
  // Returns the bounds of the meshes of the instances decoded so far, without meshes of data formats 1 to 3.
  const std::map<MeshKey, Aabbf>& mesh_bounds() const { return mesh_bounds_; }
  // Returns the state once all chunks were added, and builds the tree of instances. Returns DATA_LOSS if chunks are
  // missing or `find_mesh` returns null.
  absl::StatusOr<SceneState> finish(const FindMesh& find_mesh) &&;

 private:
  // Columns of the instances of one mesh.
  struct Placed {
    std::vector<uint64_t> ids, groups, tags;
    std::vector<uint32_t> layers;
    std::vector<double> translations;
    std::vector<float> rotations, scales;
  };
  void read_header(ByteReader& reader, BytesKind kind);
  void read_writers(ByteReader& reader, BytesKind kind);
  void read_instances(ByteReader& reader, BytesKind kind);
  // Reads the bounds of `meshes`.
  void read_bounds(ByteReader& reader, absl::Span<const MeshKey> meshes);
  void read_compounds(ByteReader& reader);
  void read_objects(ByteReader& reader, BytesKind kind);
  void read_expiries(ByteReader& reader);
  void read_leases(ByteReader& reader);
  // Returns DATA_LOSS if the chunks do not have exactly what the header counts.
  absl::Status check_counts() const;
  absl::Status place(const FindMesh& find_mesh);

  SceneState state_;
  bool begun_ = false;
  uint64_t writers_ = 0;    // expected number of writers, from the header
  uint64_t instances_ = 0;  // expected number of instances, from the header
  uint64_t objects_ = 0;    // expected number of objects, from the header
  uint64_t instances_read_ = 0;
  uint64_t objects_read_ = 0;
  uint64_t compounds_ = 0;       // expected number of compounds, from their chunks
  uint64_t expiries_ = 0;        // expected number of expiries, from the header
  uint64_t leases_ = 0;          // expected number of leases, from the header
  uint64_t leased_objects_ = 0;  // number of objects of the last lease that later chunks have
  std::map<MeshKey, Placed> placed_;
  std::map<MeshKey, Aabbf> mesh_bounds_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_STATE_READER_H_
