// Writer of a glTF 2.0 scene in its binary form (GLB). The scene is collected in memory, and one call of write() writes
// the whole file. For the exporter. One writer writes one file in one thread. Source: Khronos Group, glTF 2.0
// Specification, 2021 (ISO/IEC 12113:2022).
//
// The importer reads such files with assimp 5.2.5. This writer does not use assimp, because assimp alters the scenes
// that it writes: transforms within 0.01 of the identity are dropped, and vertices nearer than 1e-5 to each other are
// merged. Moreover, assimp needs 400 bytes of memory per triangle.
//
// Invariants: every accessor lies within the file's single buffer; node 0 is the root, and the nodes that add_node()
// and add_group() add are its children.
#ifndef LOCUS_CLIENT_CLI_LEVELS_EXPORT_GLB_WRITER_H_
#define LOCUS_CLIENT_CLI_LEVELS_EXPORT_GLB_WRITER_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/levels/import/imported_mesh.h"
#include "client/cli/output.h"

namespace locus::cli {

// Maximum number of nodes in a file. A capsule takes four nodes, or one if its half axis is zero. An instance or an
// object of any other shape takes one node. The RESOURCE_EXHAUSTED errors of GlbWriter name the limit that was
// exceeded.
inline constexpr size_t kMaxExportNodes = size_t{1} << 20;
// Maximum size of a file in bytes: the GLB format stores sizes in 32 bits.
inline constexpr uint64_t kMaxExportBytes = UINT32_MAX;
// Maximum number of parts of a mesh. A mesh with more parts is written as a single part.
inline constexpr size_t kMaxExportParts = 4096;

// Transform from a node's coordinates to its parent's: scale, then rotation (quaternion x, y, z, w), then translation.
struct GlbPlace {
  std::array<float, 3> translation{};
  std::array<float, 4> rotation{0, 0, 0, 1};
  std::array<float, 3> scale{1, 1, 1};
};

// Upward axis of the scene's coordinates. glTF requires y up, so z-up scenes get a rotation at the root.
enum class UpAxis { kY, kZ };

class GlbWriter {
 public:
  explicit GlbWriter(const std::string& root_name, UpAxis up);

  // Returns the index of a new, empty mesh. set_mesh() must fill it before write().
  size_t reserve_mesh();
  // Copies `mesh` into the reserved mesh `mesh_index`. Each part gets its own copy of the vertices that it uses, and a
  // material of the part's name. Returns RESOURCE_EXHAUSTED if the file would exceed kMaxExportBytes.
  absl::Status set_mesh(size_t mesh_index, const ImportedMesh& mesh);

  // Adds a node that is a child of the root and draws the mesh of index `mesh`. `extras` are glTF's
  // application-specific properties, which editors show with the node. Returns RESOURCE_EXHAUSTED beyond
  // kMaxExportNodes.
  absl::Status add_node(const std::string& name, const GlbPlace& place, size_t mesh, const Json& extras);
  // Mesh drawn by a child node of a group; `place` is relative to the group.
  struct Child {
    size_t mesh = 0;
    GlbPlace place;
  };
  // Adds a node that is a child of the root. The new node has one child node for each of `children`. Returns the same
  // errors as add_node().
  absl::Status add_group(const std::string& name, const GlbPlace& place, const std::vector<Child>& children,
                         const Json& extras);

  size_t node_count() const { return node_count_; }

  // Writes a temporary file next to `path` and renames it, so that `path` never contains a partial file. Precondition:
  // every reserved mesh is set. Returns the file's size in bytes, FAILED_PRECONDITION if the path cannot be written, or
  // RESOURCE_EXHAUSTED beyond kMaxExportBytes.
  absl::StatusOr<uint64_t> write(const std::string& path) const;

 private:
  absl::Status ensure_room(size_t nodes) const;
  void append_node(const Json& node);
  size_t add_view(const void* data, size_t bytes, int target);
  size_t material(const std::string& name);
  Json add_primitive(const ImportedMesh& mesh, size_t first_index, size_t end_index, const std::string& material_name);
  std::string json() const;

  Json root_;
  std::string nodes_;  // JSON of all nodes except the root, each preceded by a comma
  size_t node_count_ = 1;
  std::vector<size_t> top_;  // node indices of the root's children
  std::vector<Json> meshes_;
  Json accessors_ = Json::array();
  Json views_ = Json::array();
  Json materials_ = Json::array();
  std::map<std::string, size_t> material_numbers_;
  std::string bytes_;                 // binary buffer
  std::vector<uint32_t> renumbered_;  // per vertex of the current mesh: its index in the current part, or kNoVertex
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_EXPORT_GLB_WRITER_H_
