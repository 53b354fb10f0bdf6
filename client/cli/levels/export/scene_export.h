// Converter of a scene's objects and instances ("things") to nodes and meshes of a GLB file. For the export command.
// One object exports one file in one thread.
//
// The node of an instance draws the instance's mesh; each mesh is written once, however many instances use it. The node
// of an object draws the unit shape of the object's kind, scaled to the object's size. Sizes below kMinDrawnSize are
// replaced by kMinDrawnSize, since editors cannot handle a scale of 0.
#ifndef LOCUS_CLIENT_CLI_LEVELS_EXPORT_SCENE_EXPORT_H_
#define LOCUS_CLIENT_CLI_LEVELS_EXPORT_SCENE_EXPORT_H_

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/cli/levels/export/glb_writer.h"
#include "client/cli/rows/scene_rows.h"

namespace locus::cli {

inline constexpr float kMinDrawnSize = 1e-6f;
// Half extent of the marker that is drawn for a point.
inline constexpr float kPointMarkSize = 0.05f;

// Returns the translation that must be subtracted from every position before the position is rounded to float. Let c be
// the centre of the bounds, rounded to whole units. The translation is c if the largest absolute coordinate of c is
// greater than 8 times the longest side of the bounds, and zero otherwise.
std::array<double, 3> recentre_of(const std::array<double, 3>& min, const std::array<double, 3>& max);

class SceneExport {
 public:
  SceneExport(const std::string& name, UpAxis up, const std::array<double, 3>& recentre)
      : writer_(name, up), recentre_(recentre) {}

  // Adds the node of an object or instance, named `object 7` or `instance 3 (mesh)`. The node's extras are: id; layers;
  // group and tag, unless they are 0; for an object, its shape. Returns RESOURCE_EXHAUSTED beyond kMaxExportNodes.
  absl::Status add(const SceneThing& thing);

  // Returns the names of the meshes that the added instances draw, in order of first use. set_mesh() must be called for
  // each of them before the file is written.
  const std::vector<std::string>& meshes() const { return mesh_names_; }
  // Sets the triangles of a mesh whose name is in meshes(). Returns the same errors as GlbWriter::set_mesh().
  absl::Status set_mesh(const std::string& name, const ImportedMesh& mesh);

  size_t things() const { return things_; }
  const GlbWriter& writer() const { return writer_; }

 private:
  enum class Part { kMarker, kBall, kBox, kDome, kTube, kCount };

  absl::StatusOr<size_t> shape_mesh(Part part);
  absl::Status add_shape(const SceneThing& thing, Part part, const std::array<float, 3>& scale);
  absl::Status add_parts(const SceneThing& thing);
  absl::Status add_drawn(const SceneThing& thing);
  absl::Status add_capsule(const SceneThing& thing);
  absl::Status add_instance(const SceneThing& thing);
  GlbPlace place_of(const SceneThing& thing) const;

  GlbWriter writer_;
  const std::array<double, 3> recentre_;
  std::array<std::optional<size_t>, static_cast<size_t>(Part::kCount)> shape_meshes_;
  std::map<std::string, size_t> mesh_numbers_;
  std::vector<std::string> mesh_names_;
  size_t things_ = 0;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_EXPORT_SCENE_EXPORT_H_
