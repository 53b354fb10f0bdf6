// A glTF 2.0 scene in its binary form (GLB), collected in memory and written at once. For the exporter. Source: Khronos
// Group, glTF 2.0 Specification, 2021 (ISO/IEC 12113:2022). One writer, one file, one thread.
//
// The library that reads such files for the importer also writes them, but not what it was given: it drops transforms
// within 0.01 of the identity, merges vertices nearer than 1e-5, and takes 400 bytes a triangle (assimp 5.2.5).
//
// Invariants: every accessor lies within the one buffer; node 0 is the root and holds every other top-level node.
#ifndef LOCUS_CLIENT_CLI_LEVELS_EXPORT_GLB_WRITER_H_
#define LOCUS_CLIENT_CLI_LEVELS_EXPORT_GLB_WRITER_H_

#include <array>
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

// A node's place within its parent: scaled, then rotated, then moved.
struct GlbPlace {
  std::array<float, 3> translation{};
  std::array<float, 4> rotation{0, 0, 0, 1};
  std::array<float, 3> scale{1, 1, 1};
};

// Which way is up in the coordinates that come in. The file's own is y.
enum class UpAxis { kY, kZ };

class GlbWriter {
 public:
  explicit GlbWriter(const std::string& root_name, UpAxis up);

  // The number of a mesh that set_mesh() will fill.
  size_t reserve_mesh();
  // Copies the mesh, each part with its own vertices and a material of its name; unused vertices are left out.
  // RESOURCE_EXHAUSTED if the file would pass kMaxExportBytes.
  absl::Status set_mesh(size_t number, const ImportedMesh& mesh);

  // A node that draws a mesh under the root. `extras` are facts that editors show beside it. RESOURCE_EXHAUSTED beyond
  // kMaxExportNodes.
  absl::Status add_node(const std::string& name, const GlbPlace& place, size_t mesh, const Json& extras);
  // A node that holds several drawings of meshes, placed within it.
  struct Child {
    size_t mesh = 0;
    GlbPlace place;
  };
  absl::Status add_group(const std::string& name, const GlbPlace& place, const std::vector<Child>& children,
                         const Json& extras);

  size_t node_count() const { return node_count_; }

  // Writes beside the path and renames, so that a file of that name is whole. Every reserved mesh is set.
  // FAILED_PRECONDITION if the path cannot be written, RESOURCE_EXHAUSTED as above. The file's size in bytes.
  absl::StatusOr<uint64_t> write(const std::string& path) const;

 private:
  absl::Status ensure_room(size_t nodes) const;
  void append_node(const Json& node);
  size_t add_view(const void* data, size_t bytes, int target);
  size_t material(const std::string& name);
  Json add_primitive(const ImportedMesh& mesh, size_t first_index, size_t end_index, const std::string& material_name);
  std::string json() const;

  Json root_;
  std::string nodes_;  // the texts of all nodes but the root, each after a comma
  size_t node_count_ = 1;
  std::vector<size_t> top_;  // numbers of the root's children
  std::vector<Json> meshes_;
  Json accessors_ = Json::array();
  Json views_ = Json::array();
  Json materials_ = Json::array();
  std::map<std::string, size_t> material_numbers_;
  std::string bytes_;                 // the buffer
  std::vector<uint32_t> renumbered_;  // of the mesh in hand: a vertex's number within the part in hand
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_EXPORT_GLB_WRITER_H_
