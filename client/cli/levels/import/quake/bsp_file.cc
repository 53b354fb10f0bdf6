#include "client/cli/levels/import/quake/bsp_file.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr std::array<absl::string_view, 17> kLumpNames = {
    "entities",   "textures", "planes",    "nodes",   "leafs", "leaffaces", "leafbrushes", "models", "brushes",
    "brushsides", "vertices", "meshverts", "effects", "faces", "lightmaps", "lightvols",   "visdata"};
constexpr size_t kTexturesLump = 1;
constexpr size_t kVerticesLump = 10;
constexpr size_t kMeshvertsLump = 11;
constexpr size_t kFacesLump = 13;
constexpr size_t kHeaderBytes = 8 + 8 * kLumpNames.size();
constexpr uint32_t kQuake3Version = 46;

constexpr size_t kTextureBytes = 72;
constexpr size_t kTextureNameBytes = 64;
constexpr size_t kVertexBytes = 44;
constexpr size_t kFaceBytes = 104;

// Returns the little-endian integer at offset `at`, independent of the machine's byte order.
uint32_t read_u32(absl::string_view bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value |= uint32_t{static_cast<uint8_t>(bytes[at + i])} << (8 * i);
  return value;
}

absl::Status damaged(size_t lump, std::optional<size_t> element, absl::string_view what) {
  const std::string path = element ? absl::StrCat(kLumpNames[lump], "[", *element, "]") : std::string(kLumpNames[lump]);
  return absl::InvalidArgumentError(
      absl::StrCat("damaged BSP, lump ", lump, " ", path, ": ", what, "; copy or compile the level again"));
}

using Lumps = std::array<absl::string_view, kLumpNames.size()>;

absl::StatusOr<Lumps> split_lumps(absl::string_view bytes) {
  if (bytes.size() < kHeaderBytes || bytes.substr(0, 4) != "IBSP") {
    return absl::InvalidArgumentError("not a Quake 3 level: a .bsp must start with IBSP and a header of 144 bytes");
  }
  if (const uint32_t version = read_u32(bytes, 4); version != kQuake3Version) {
    return absl::InvalidArgumentError(absl::StrCat("IBSP version ", version,
                                                   " is not supported, only 46 (Quake 3, OpenArena): give another "
                                                   "level or convert it to OBJ"));
  }
  Lumps lumps;
  for (size_t lump = 0; lump < lumps.size(); ++lump) {
    const uint32_t offset = read_u32(bytes, 8 + 8 * lump);
    const uint32_t length = read_u32(bytes, 12 + 8 * lump);
    if (offset > bytes.size() || length > bytes.size() - offset) {
      return damaged(lump, std::nullopt,
                     absl::StrCat("bytes ", offset, " + ", length, " lie outside the file of ", bytes.size()));
    }
    lumps[lump] = bytes.substr(offset, length);
  }
  return lumps;
}

absl::StatusOr<size_t> count_elements(const Lumps& lumps, size_t lump, size_t element_bytes) {
  if (lumps[lump].size() % element_bytes != 0) {
    return damaged(lump, std::nullopt,
                   absl::StrCat(lumps[lump].size(), " bytes are no multiple of ", element_bytes, " an element"));
  }
  return lumps[lump].size() / element_bytes;
}

absl::Status read_textures(const Lumps& lumps, BspFile& file) {
  ASSIGN_OR_RETURN(const size_t count, count_elements(lumps, kTexturesLump, kTextureBytes));
  for (size_t i = 0; i < count; ++i) {
    const absl::string_view field = lumps[kTexturesLump].substr(i * kTextureBytes, kTextureNameBytes);
    file.textures.emplace_back(field.substr(0, field.find('\0')));
  }
  return absl::OkStatus();
}

absl::Status read_vertices(const Lumps& lumps, BspFile& file) {
  ASSIGN_OR_RETURN(const size_t count, count_elements(lumps, kVerticesLump, kVertexBytes));
  file.vertices.resize(count);
  for (size_t i = 0; i < count; ++i) {
    for (size_t axis = 0; axis < 3; ++axis) {
      const float value = std::bit_cast<float>(read_u32(lumps[kVerticesLump], i * kVertexBytes + 4 * axis));
      if (!std::isfinite(value)) return damaged(kVerticesLump, i, "the position is not finite");
      file.vertices[i][axis] = value;
    }
  }
  return absl::OkStatus();
}

absl::Status read_meshverts(const Lumps& lumps, BspFile& file) {
  ASSIGN_OR_RETURN(const size_t count, count_elements(lumps, kMeshvertsLump, sizeof(uint32_t)));
  file.meshverts.resize(count);
  for (size_t i = 0; i < count; ++i) file.meshverts[i] = read_u32(lumps[kMeshvertsLump], i * sizeof(uint32_t));
  return absl::OkStatus();
}

// Returns whether first + count <= size. The sum is computed in 64 bits, since it can exceed 2^32: a negative integer
// in the file is read as a large unsigned integer.
bool is_range(uint32_t first, uint32_t count, size_t size) { return uint64_t{first} + count <= size; }

absl::Status check_patch(size_t face_index, const BspFace& face) {
  const uint64_t width = face.patch_width;
  const uint64_t height = face.patch_height;
  if (width < 3 || height < 3 || width % 2 == 0 || height % 2 == 0 || width * height != face.vertex_count) {
    return damaged(kFacesLump, face_index,
                   absl::StrCat("a patch of ", width, " x ", height, " control points with ", face.vertex_count,
                                " vertices; sides must be odd, at least 3, and multiply to the vertices"));
  }
  return absl::OkStatus();
}

absl::Status check_meshverts(size_t face_index, const BspFace& face, const BspFile& file) {
  if (!is_range(face.first_meshvert, face.meshvert_count, file.meshverts.size())) {
    return damaged(
        kFacesLump, face_index,
        absl::StrCat("meshverts ", face.first_meshvert, " + ", face.meshvert_count, " of ", file.meshverts.size()));
  }
  if (face.meshvert_count % 3 != 0) {
    return damaged(kFacesLump, face_index, absl::StrCat(face.meshvert_count, " meshverts are no whole triangles"));
  }
  for (size_t i = face.first_meshvert; i < size_t{face.first_meshvert} + face.meshvert_count; ++i) {
    if (file.meshverts[i] >= face.vertex_count) {
      return damaged(
          kMeshvertsLump, i,
          absl::StrCat("vertex ", file.meshverts[i], " of the ", face.vertex_count, " of faces[", face_index, "]"));
    }
  }
  return absl::OkStatus();
}

absl::Status check_face(size_t face_index, const BspFace& face, const BspFile& file) {
  if (face.texture >= file.textures.size()) {
    return damaged(kFacesLump, face_index, absl::StrCat("texture ", face.texture, " of ", file.textures.size()));
  }
  // Skip the checks of vertices for a billboard, since its vertices are never used.
  if (face.type == BspFaceType::kBillboard) return absl::OkStatus();
  if (!is_range(face.first_vertex, face.vertex_count, file.vertices.size())) {
    return damaged(
        kFacesLump, face_index,
        absl::StrCat("vertices ", face.first_vertex, " + ", face.vertex_count, " of ", file.vertices.size()));
  }
  return face.type == BspFaceType::kPatch ? check_patch(face_index, face) : check_meshverts(face_index, face, file);
}

absl::Status read_faces(const Lumps& lumps, BspFile& file) {
  ASSIGN_OR_RETURN(const size_t count, count_elements(lumps, kFacesLump, kFaceBytes));
  file.faces.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    const absl::string_view bytes = lumps[kFacesLump].substr(i * kFaceBytes, kFaceBytes);
    const uint32_t type = read_u32(bytes, 8);
    if (type < 1 || type > 4) {
      return damaged(kFacesLump, i, absl::StrCat("face type ", type, " is unknown, there are 1 to 4"));
    }
    BspFace face;
    face.texture = read_u32(bytes, 0);
    face.type = static_cast<BspFaceType>(type);
    face.first_vertex = read_u32(bytes, 12);
    face.vertex_count = read_u32(bytes, 16);
    face.first_meshvert = read_u32(bytes, 20);
    face.meshvert_count = read_u32(bytes, 24);
    face.patch_width = read_u32(bytes, 96);
    face.patch_height = read_u32(bytes, 100);
    RETURN_IF_ERROR(check_face(i, face, file));
    file.faces.push_back(face);
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<BspFile> parse_bsp(absl::string_view bytes) {
  ASSIGN_OR_RETURN(const Lumps lumps, split_lumps(bytes));
  BspFile file;
  for (const auto read : {read_textures, read_vertices, read_meshverts, read_faces}) {
    RETURN_IF_ERROR(read(lumps, file));
  }
  return file;
}

}  // namespace locus::cli
