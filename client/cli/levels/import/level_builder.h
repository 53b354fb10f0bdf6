// Builder of one upload-ready mesh from the triangles of one file, collected in double. For the importers. One builder,
// one file, one thread. Invariant: every index added is below the number of vertices added.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_LEVEL_BUILDER_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_LEVEL_BUILDER_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/levels/import/imported_mesh.h"

namespace locus::cli {

class LevelBuilder {
 public:
  // Creates an empty builder. `scale` multiplies every added coordinate.
  explicit LevelBuilder(double scale) : scale_(scale) {}

  // Begins a part: triangles added from now on belong to it. The name of the last part continues that part. Parts
  // without triangles are dropped. After kMaxImportParts parts, all further triangles belong to the last one.
  void begin_part(absl::string_view name);

  // Returns RESOURCE_EXHAUSTED if adding this many vertices and triangles would exceed a limit. Call it before adding.
  absl::Status ensure_room(size_t vertices, size_t triangles) const;

  // Adds a vertex and returns its index.
  uint32_t add_vertex(const std::array<double, 3>& position);
  // Adds a triangle of three vertex indices, counter-clockwise seen from outside.
  void add_triangle(uint32_t a, uint32_t b, uint32_t c);

  size_t vertex_count() const { return positions_.size(); }
  size_t triangle_count() const { return indices_.size() / 3; }

  // Returns the level with one mesh. Recentres it if its bounds are far from the origin, rounds once to float, merges
  // equal vertices and drops unused ones. INVALID_ARGUMENT if there is no triangle, or if a used coordinate is not
  // finite and within kMaxImportCoordinate. Linear.
  absl::StatusOr<ImportedLevel> finish(std::string name) &&;

 private:
  struct Box {
    std::array<double, 3> min, max;
  };

  absl::StatusOr<Box> bounds() const;

  double scale_;
  std::vector<std::array<double, 3>> positions_;
  std::vector<uint32_t> indices_;
  std::vector<MeshPart> parts_;
  bool parts_overflowed_ = false;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_LEVEL_BUILDER_H_
