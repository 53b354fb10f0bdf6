// The project's own readers of level files (Quake 3 levels and archives), its checks of OBJ, STL, PLY and glTF files,
// and the reader of the answer of the importer process. An accepted level is a valid mesh within the limits. A glTF
// file's references lead to no file outside the folder of the glTF file.
#include <cmath>
#include <filesystem>

#include "absl/strings/match.h"
#include "client/cli/levels/import/count_check.h"
#include "client/cli/levels/import/gltf_check.h"
#include "client/cli/levels/import/import_limits.h"
#include "client/cli/levels/import/level_codec.h"
#include "client/cli/levels/import/ply_check.h"
#include "client/cli/levels/import/ply_strips.h"
#include "client/cli/levels/import/quake/bsp_import.h"
#include "client/cli/levels/import/quake/pk3_archive.h"
#include "tests/fuzz/fuzz_target.h"

namespace locus::cli {
namespace {

void check_mesh(const ImportedMesh& mesh) {
  LOCUS_CHECK(mesh.vertices.size() % 3 == 0 && mesh.indices.size() % 3 == 0 && !mesh.indices.empty());
  LOCUS_CHECK_LE(mesh.indices.size() / 3, kMaxImportTriangles);
  for (const float coordinate : mesh.vertices) LOCUS_CHECK(std::isfinite(coordinate));
  for (const uint32_t index : mesh.indices) LOCUS_CHECK_LT(index, mesh.vertices.size() / 3);
  LOCUS_CHECK_LE(mesh.parts.size(), kMaxImportParts);
  for (size_t i = 0; i < mesh.parts.size(); ++i) {
    LOCUS_CHECK_LE(mesh.parts[i].name.size(), kMaxPartNameBytes);
    LOCUS_CHECK_LT(mesh.parts[i].first_triangle, mesh.indices.size() / 3);
    if (i > 0) LOCUS_CHECK_LT(mesh.parts[i - 1].first_triangle, mesh.parts[i].first_triangle);
  }
}

LOCUS_FUZZ_TARGET(bsp) {
  ImportOptions options;
  options.patch_subdivisions = 2;
  const absl::StatusOr<ImportedLevel> level = import_bsp(input, "level", options);
  if (!level.ok()) return fuzz::check_error(level.status());
  LOCUS_CHECK_EQ(level->meshes.size(), 1u);
  check_mesh(level->meshes[0]);
}

LOCUS_FUZZ_TARGET(ply) {
  const absl::StatusOr<std::optional<std::string>> unpacked = unpack_ply_strips(input);
  if (!unpacked.ok()) return fuzz::check_error(unpacked.status());
  if (unpacked->has_value()) LOCUS_CHECK(check_ply(**unpacked).ok());
  const absl::StatusOr<uint64_t> faces = check_ply(input);
  if (!faces.ok()) return fuzz::check_error(faces.status());
  LOCUS_CHECK_LE(*faces, kMaxImportTriangles);
}

LOCUS_FUZZ_TARGET(obj_and_stl) {
  for (const ElementCounts counts : {count_obj(input), count_stl(input)}) {
    LOCUS_CHECK_LE(counts.triangles, input.size());
    LOCUS_CHECK_LE(counts.vertices, 3 * input.size());
    LOCUS_CHECK(check_counts(counts).ok());  // inputs of a fuzzer are too short to exceed a limit
  }
}

LOCUS_FUZZ_TARGET(gltf) {
  const absl::StatusOr<std::vector<std::string>> uris = check_gltf(input);
  if (!uris.ok()) return fuzz::check_error(uris.status());
  LOCUS_CHECK_LE(uris->size(), kMaxReferencedFiles);
  for (const std::string& uri : *uris) {
    const absl::StatusOr<std::string> path = path_of_reference(uri);
    if (!path.ok()) {
      fuzz::check_error(path.status());
      continue;
    }
    LOCUS_CHECK(!path->empty() && path->front() != '/');
    const std::string whole = std::filesystem::path("/level/folder/" + *path).lexically_normal().string();
    LOCUS_CHECK(absl::StartsWith(whole, "/level/folder/"));
    LOCUS_CHECK(path->find('\0') == std::string::npos);
  }
}

LOCUS_FUZZ_TARGET(pk3) {
  const absl::StatusOr<Pk3Level> level = read_pk3_level(input, "a.pk3", "");
  if (!level.ok()) {
    // libzip puts names and values of the archive into its messages, which decode_level() cleans.
    LOCUS_CHECK(!absl::IsInternal(level.status()) && !level.status().message().empty());
    return;
  }
  LOCUS_CHECK_LE(level->bytes.size(), kMaxBspBytes);
  LOCUS_CHECK(level->bytes.size() <= kMinCheckedBytes || level->bytes.size() / kMaxArchiveRatio <= input.size());
  LOCUS_CHECK_LE(level->entry.size(), kMaxEntryNameBytes);
}

LOCUS_FUZZ_TARGET(level_answer) {
  const absl::StatusOr<ImportedLevel> level = decode_level(input);
  if (!level.ok()) {
    fuzz::check_error(level.status());
    LOCUS_CHECK(decode_level(encode_level(level)).status() == level.status());
    return;
  }
  for (const ImportedMesh& mesh : level->meshes) check_mesh(mesh);
  const std::string bytes = encode_level(level);
  const absl::StatusOr<ImportedLevel> again = decode_level(bytes);
  LOCUS_CHECK(again.ok());
  LOCUS_CHECK(encode_level(again) == bytes);
}

}  // namespace
}  // namespace locus::cli
