#include "client/cli/levels/import/quake/bsp_import.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/levels/import/import_error.h"
#include "client/cli/levels/import/import_limits.h"
#include "client/cli/levels/import/level_builder.h"
#include "client/cli/levels/import/quake/bezier_patch.h"
#include "client/cli/levels/import/quake/bsp_file.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

PatchPoint to_double(const std::array<float, 3>& position) { return {position[0], position[1], position[2]}; }

uint64_t triangles_of(const BspFace& face, int subdivisions) {
  switch (face.type) {
    case BspFaceType::kPolygon:
    case BspFaceType::kMesh:
      return face.meshvert_count / 3;
    case BspFaceType::kPatch: {
      const uint64_t patches = uint64_t{face.patch_width / 2} * (face.patch_height / 2);
      return patches * 2 * static_cast<uint64_t>(subdivisions) * static_cast<uint64_t>(subdivisions);
    }
    case BspFaceType::kBillboard:
      return 0;
  }
  return 0;
}

// Checks the total number of triangles before any triangle is built. Without this check a small file could cause
// unbounded memory use, since many faces of a file can share the same meshverts (entries of its list of triangle
// corners).
absl::Status check_triangles(const BspFile& file, int subdivisions) {
  uint64_t total = 0;
  for (size_t i = 0; i < file.faces.size(); ++i) {
    total += triangles_of(file.faces[i], subdivisions);
    if (total > kMaxBspTriangles) {
      return exceeds(absl::StrCat("lump 13 faces[", i, "]: the level"), "more triangles", "level_triangles",
                     kMaxBspTriangles, "give fewer patch subdivisions");
    }
  }
  return absl::OkStatus();
}

void add_listed_triangles(const BspFile& file, const BspFace& face, LevelBuilder& builder) {
  // The builder's first vertices are those of the level, in the same order, so the level's vertex indices are valid in
  // the builder.
  for (size_t i = 0; i < face.meshvert_count; i += 3) {
    const uint32_t* corner = &file.meshverts[face.first_meshvert + i];
    builder.add_triangle(face.first_vertex + corner[0], face.first_vertex + corner[2], face.first_vertex + corner[1]);
  }
}

void add_patch(const BspFile& file, const BspFace& face, int subdivisions, LevelBuilder& builder) {
  std::vector<PatchPoint> controls;
  controls.reserve(face.vertex_count);
  for (size_t i = 0; i < face.vertex_count; ++i) controls.push_back(to_double(file.vertices[face.first_vertex + i]));
  const PatchGrid grid = tessellate_patch(controls, face.patch_width, face.patch_height, subdivisions);

  const auto first = static_cast<uint32_t>(builder.vertex_count());
  for (const PatchPoint& point : grid.points) builder.add_vertex(point);
  const auto width = static_cast<uint32_t>(grid.width);
  for (uint32_t y = 0; y + 1 < grid.height; ++y) {
    for (uint32_t x = 0; x + 1 < width; ++x) {
      const uint32_t corner = first + y * width + x;
      builder.add_triangle(corner, corner + 1, corner + width);
      builder.add_triangle(corner + 1, corner + width + 1, corner + width);
    }
  }
}

}  // namespace

absl::StatusOr<ImportedLevel> import_bsp(absl::string_view bytes, const std::string& name,
                                         const ImportOptions& options) {
  if (bytes.size() > kMaxBspBytes) {
    return exceeds("the level", absl::StrCat(bytes.size(), " bytes"), "level_bytes", kMaxBspBytes,
                   "give another level");
  }
  ASSIGN_OR_RETURN(const BspFile file, parse_bsp(bytes));
  RETURN_IF_ERROR(check_triangles(file, options.patch_subdivisions));

  LevelBuilder builder(options.scale);
  for (const std::array<float, 3>& vertex : file.vertices) builder.add_vertex(to_double(vertex));
  size_t patches = 0;
  size_t billboards = 0;
  for (const BspFace& face : file.faces) {
    if (face.type == BspFaceType::kBillboard) {
      ++billboards;
      continue;
    }
    builder.begin_part(file.textures[face.texture]);
    if (face.type == BspFaceType::kPatch) {
      ++patches;
      add_patch(file, face, options.patch_subdivisions, builder);
    } else {
      add_listed_triangles(file, face, builder);
    }
  }
  ASSIGN_OR_RETURN(ImportedLevel level, std::move(builder).finish(name));
  level.source_format = "Quake 3 BSP";
  if (patches > 0) {
    level.notes.push_back(absl::StrCat(patches, " curved faces were cut into ", options.patch_subdivisions, " x ",
                                       options.patch_subdivisions, " quads for each 3 x 3 patch."));
  }
  if (billboards > 0) level.notes.push_back(absl::StrCat(billboards, " billboards were skipped."));
  return level;
}

}  // namespace locus::cli
