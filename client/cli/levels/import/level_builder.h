// Collects the triangles of one file in double and turns them into one upload-ready mesh. For the importers of this
// room. One builder, one file, one thread. Keeps: every index added is below the number of vertices added.
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
  // scale multiplies every coordinate added.
  explicit LevelBuilder(double scale) : scale_(scale) {}

  // Triangles from here on belong to a part of this name. Asking for the name of the last part goes on with it, a part
  // that got no triangle vanishes, and beyond kMaxImportParts all goes into the last.
  void begin_part(absl::string_view name);

  // RESOURCE_EXHAUSTED if so many more would pass a limit. Call it before adding.
  absl::Status ensure_room(size_t vertices, size_t triangles) const;

  // The new vertex's number.
  uint32_t add_vertex(const std::array<double, 3>& position);
  // Vertex numbers in counter-clockwise order seen from outside.
  void add_triangle(uint32_t a, uint32_t b, uint32_t c);

  size_t vertex_count() const { return positions_.size(); }
  size_t triangle_count() const { return indices_.size() / 3; }

  // Recentres if the box is far from the origin, rounds once to float, shares equal vertices and drops unused ones.
  // INVALID_ARGUMENT without a triangle, or if a used coordinate is not within kMaxImportCoordinate. Linear.
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
