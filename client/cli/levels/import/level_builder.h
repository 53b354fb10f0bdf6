// Builder of one upload-ready mesh from the triangles of one file. Coordinates are collected in double and rounded to
// float once. Names of parts are sanitized, so that they can be sent and printed. For the importers. Each builder is
// used by one thread. Invariant: every index added is below the number of vertices added.
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

// Returns clean_text() of `raw` with at most kMaxPartNameBytes.
std::string clean_part_name(absl::string_view raw);

class LevelBuilder {
 public:
  // Creates an empty builder. `scale` multiplies every added coordinate.
  explicit LevelBuilder(double scale) : scale_(scale) {}

  // Begins a part, to which the triangles added from now on belong. If `name` is the name of the last part, that part
  // is continued. Parts without triangles are dropped. After kMaxImportParts parts, all further triangles belong to the
  // last part.
  void begin_part(absl::string_view name);

  // Returns RESOURCE_EXHAUSTED if adding this many vertices and triangles would exceed a limit. Call it before adding
  // them, since the functions below do not check.
  absl::Status ensure_room(size_t vertices, size_t triangles) const;

  // Adds a vertex and returns its index.
  uint32_t add_vertex(const std::array<double, 3>& position);
  // Adds a triangle of three vertex indices, counter-clockwise seen from outside.
  void add_triangle(uint32_t a, uint32_t b, uint32_t c);

  size_t vertex_count() const { return positions_.size(); }
  size_t triangle_count() const { return indices_.size() / 3; }

  // Returns the level with its single mesh. Recentres the level if its bounds are far from the origin, rounds
  // coordinates once to float, merges equal vertices and drops unused vertices. Returns INVALID_ARGUMENT if there is no
  // triangle, or if a used coordinate is not finite or exceeds kMaxImportCoordinate. Cost: linear.
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
