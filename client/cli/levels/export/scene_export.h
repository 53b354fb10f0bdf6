// From the things of a scene to the nodes and meshes of a GLB file. For the export command. One exporter, one file, one
// thread.
//
// Instances draw their mesh, which is written once; objects draw the unit shape of their kind, scaled. A size of 0 is
// drawn as kMinDrawnSize, since editors cannot work with things that have none.
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
// Half the size of the mark that stands for a point.
inline constexpr float kPointMarkSize = 0.05f;

// The translation to take away from every position before it is rounded to float: the middle of the bounds in whole
// units if that is further from the origin than 8 times their longest side, as for imports, else zero.
std::array<double, 3> recentre_of(const std::array<double, 3>& min, const std::array<double, 3>& max);

class SceneExport {
 public:
  SceneExport(const std::string& name, UpAxis up, const std::array<double, 3>& recentre)
      : writer_(name, up), recentre_(recentre) {}

  // Nodes are named `object 7` and `instance 3 (mesh)` and carry id, group, tag and layers. RESOURCE_EXHAUSTED beyond
  // kMaxExportNodes.
  absl::Status add(const SceneThing& thing);

  // Names of the meshes that instances so far draw, in the order of their first use.
  const std::vector<std::string>& meshes() const { return mesh_names_; }
  // Gives one of them its triangles. Errors as GlbWriter::set_mesh().
  absl::Status set_mesh(const std::string& name, const ImportedMesh& mesh);

  size_t things() const { return things_; }
  const GlbWriter& writer() const { return writer_; }

 private:
  enum class Part { kMarker, kBall, kBox, kDome, kTube, kCount };

  absl::StatusOr<size_t> shape_mesh(Part part);
  absl::Status add_shape(const SceneThing& thing, Part part, const std::array<float, 3>& scale);
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
