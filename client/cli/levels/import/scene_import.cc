#include "client/cli/levels/import/scene_import.h"

#include <assimp/MemoryIOWrapper.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "client/cli/levels/import/clean_text.h"
#include "client/cli/levels/import/count_check.h"
#include "client/cli/levels/import/import_error.h"
#include "client/cli/levels/import/import_limits.h"
#include "client/cli/levels/import/input_file.h"
#include "client/cli/levels/import/level_builder.h"
#include "client/cli/levels/import/ply_check.h"
#include "client/cli/levels/import/ply_strips.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

// Affine transform as a 3 x 4 matrix. Column 3 of each row is the translation.
struct Affine {
  std::array<std::array<double, 4>, 3> rows{};

  static Affine from(const aiMatrix4x4& m) {
    return {{{{m.a1, m.a2, m.a3, m.a4}, {m.b1, m.b2, m.b3, m.b4}, {m.c1, m.c2, m.c3, m.c4}}}};
  }

  Affine times(const Affine& inner) const {
    Affine product;
    for (size_t r = 0; r < 3; ++r) {
      for (size_t c = 0; c < 4; ++c) {
        product.rows[r][c] = rows[r][0] * inner.rows[0][c] + rows[r][1] * inner.rows[1][c] +
                             rows[r][2] * inner.rows[2][c] + (c == 3 ? rows[r][3] : 0.0);
      }
    }
    return product;
  }

  std::array<double, 3> apply(const aiVector3D& p) const {
    std::array<double, 3> result;
    for (size_t r = 0; r < 3; ++r) {
      result[r] = rows[r][0] * p.x + rows[r][1] * p.y + rows[r][2] * p.z + rows[r][3];
    }
    return result;
  }

  bool mirrors() const {
    const auto& m = rows;
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
               m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]) <
           0;
  }
};

absl::Status refusal(absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat(what, "; export the file again or convert it to GLB"));
}

// File system for assimp that contains only the files of one level, in memory.
class MemoryFiles final : public Assimp::IOSystem {
 public:
  // Borrows the files.
  explicit MemoryFiles(const LevelFiles& files) : files_(files) {}

  bool Exists(const char* name) const override { return find(name) != nullptr; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* name, const char* mode) override {
    const std::string* bytes = find(name);
    if (bytes == nullptr || mode[0] != 'r') return nullptr;
    return new Assimp::MemoryIOStream(reinterpret_cast<const uint8_t*>(bytes->data()), bytes->size());
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  const std::string* find(const std::string& name) const {
    if (name == files_.name) return &files_.bytes;
    const auto found = files_.referenced.find(name);
    return found == files_.referenced.end() ? nullptr : &found->second;
  }

  const LevelFiles& files_;
};

// Parses the file with assimp. assimp throws exceptions for some damaged files and when memory is exhausted; this
// function converts them to errors.
absl::StatusOr<const aiScene*> parse(Assimp::Importer& importer, const LevelFiles& files) {
  const aiScene* scene = nullptr;
  importer.SetIOHandler(new MemoryFiles(files));  // owned by the importer
  try {
    scene = importer.ReadFile(files.name, 0);
  } catch (const std::exception& error) {
    return refusal(absl::StrCat("cannot read ", files.name, ": ", error.what()));
  }
  if (scene == nullptr) return refusal(absl::StrCat("cannot read ", files.name, ": ", importer.GetErrorString()));
  if (scene->mRootNode == nullptr) return refusal(absl::StrCat("cannot read ", files.name, ": it has no scene"));
  if (scene->mNumMeshes > kMaxSceneMeshes) {
    return exceeds("the file", absl::StrCat(scene->mNumMeshes, " meshes"), "scene_meshes", kMaxSceneMeshes,
                   "join its meshes");
  }
  return scene;
}

// Checks that coordinates are finite and indices are in range. Must be called before triangulation, which does not
// check indices. assimp's parser does not check indices of some formats either.
absl::Status check_mesh(const aiMesh& mesh, size_t index) {
  const std::string name = absl::StrCat("mesh ", index, " (", clean_text(mesh.mName.C_Str(), kMaxPartNameBytes), ")");
  for (size_t v = 0; v < mesh.mNumVertices; ++v) {
    const aiVector3D& p = mesh.mVertices[v];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      return refusal(absl::StrCat(name, ": vertex ", v, " is not finite"));
    }
  }
  for (size_t f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    for (size_t i = 0; i < face.mNumIndices; ++i) {
      if (face.mIndices[i] >= mesh.mNumVertices) {
        return refusal(absl::StrCat(name, ": face ", f, " names vertex ", face.mIndices[i], " of ", mesh.mNumVertices));
      }
    }
  }
  return absl::OkStatus();
}

struct FaceCounts {
  uint64_t faces = 0;
  uint64_t points_and_lines = 0;
  uint64_t triangles = 0;  // number after triangulation: n - 2 for a polygon of n corners
};

FaceCounts count_faces(const aiScene& scene) {
  FaceCounts counts;
  for (size_t m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    counts.faces += mesh.mNumFaces;
    for (size_t f = 0; f < mesh.mNumFaces; ++f) {
      const unsigned corners = mesh.mFaces[f].mNumIndices;
      counts.points_and_lines += corners < 3 ? 1 : 0;
      counts.triangles += corners < 3 ? 0 : corners - 2;
    }
  }
  return counts;
}

// Checks the bytes of an OBJ, PLY or STL file before assimp reads them. Returns the number of faces that the header of
// a PLY file declares; nullopt for a file of any other format.
absl::StatusOr<std::optional<uint64_t>> check_bytes(const LevelFiles& files) {
  const std::string extension = lower_extension(files.name);
  if (extension == ".obj") RETURN_IF_ERROR(check_counts(count_obj(files.bytes)));
  if (extension == ".stl") RETURN_IF_ERROR(check_counts(count_stl(files.bytes)));
  if (extension != ".ply") return std::nullopt;
  ASSIGN_OR_RETURN(const uint64_t declared, check_ply(files.bytes));
  return declared;
}

absl::Status check_scene(const aiScene& scene, const FaceCounts& found, std::optional<uint64_t> declared) {
  if (declared.has_value() && *declared != found.faces) {
    return refusal(absl::StrCat("the PLY header declares ", *declared, " faces, but ", found.faces, " were read"));
  }
  for (size_t m = 0; m < scene.mNumMeshes; ++m) {
    RETURN_IF_ERROR(check_mesh(*scene.mMeshes[m], m));
  }
  return absl::OkStatus();
}

absl::Status add_mesh(const aiMesh& mesh, const Affine& to_world, LevelBuilder& builder) {
  RETURN_IF_ERROR(builder.ensure_room(mesh.mNumVertices, mesh.mNumFaces));
  const auto first = static_cast<uint32_t>(builder.vertex_count());
  for (size_t v = 0; v < mesh.mNumVertices; ++v) builder.add_vertex(to_world.apply(mesh.mVertices[v]));
  const bool mirrored = to_world.mirrors();
  for (size_t f = 0; f < mesh.mNumFaces; ++f) {
    const aiFace& face = mesh.mFaces[f];
    if (face.mNumIndices != 3) continue;
    const uint32_t b = first + face.mIndices[mirrored ? 2 : 1];
    const uint32_t c = first + face.mIndices[mirrored ? 1 : 2];
    builder.add_triangle(first + face.mIndices[0], b, c);
  }
  return absl::OkStatus();
}

std::string part_name(const aiNode& node, const aiMesh& mesh) {
  const absl::string_view node_name = node.mName.C_Str();
  const absl::string_view mesh_name = mesh.mName.C_Str();
  if (node_name.empty() || node.mParent == nullptr) return std::string(mesh_name);
  if (mesh_name.empty() || mesh_name == node_name) return std::string(node_name);
  return absl::StrCat(node_name, "/", mesh_name);
}

struct PlacedNode {
  const aiNode* node = nullptr;
  Affine to_world;
  size_t depth = 0;
};

// Adds the meshes of all nodes in depth-first order. Uses an explicit stack instead of recursion, since the untrusted
// file determines the depth of the tree.
absl::Status add_nodes(const aiScene& scene, LevelBuilder& builder) {
  std::vector<PlacedNode> stack = {{scene.mRootNode, Affine::from(scene.mRootNode->mTransformation), 0}};
  size_t nodes = 0;
  size_t uses = 0;
  while (!stack.empty()) {
    const PlacedNode placed = stack.back();
    const aiNode& node = *placed.node;
    stack.pop_back();
    if (++nodes > kMaxSceneNodes || placed.depth > kMaxSceneDepth + 1) {
      return exceeds("the scene", "more nodes, or deeper nesting", "scene_nodes", kMaxSceneNodes, "flatten its nodes");
    }
    for (size_t i = 0; i < node.mNumMeshes; ++i) {
      if (++uses > kMaxSceneMeshUses) {
        return exceeds("the scene", "more uses of meshes", "scene_mesh_uses", kMaxSceneMeshUses, "join its meshes");
      }
      if (node.mMeshes[i] >= scene.mNumMeshes) return refusal("a node names a mesh that is not there");
      const aiMesh& mesh = *scene.mMeshes[node.mMeshes[i]];
      builder.begin_part(part_name(node, mesh));
      RETURN_IF_ERROR(add_mesh(mesh, placed.to_world, builder));
    }
    for (size_t i = node.mNumChildren; i-- > 0;) {
      const aiNode* child = node.mChildren[i];
      stack.push_back({child, placed.to_world.times(Affine::from(child->mTransformation)), placed.depth + 1});
    }
  }
  return absl::OkStatus();
}

std::string format_name(const std::string& path) {
  const std::string extension = lower_extension(path);
  if (extension == ".obj") return "OBJ";
  if (extension == ".ply") return "PLY";
  if (extension == ".stl") return "STL";
  return extension == ".glb" ? "GLB" : "glTF";
}

void add_notes(const FaceCounts& found, uint64_t triangles_left, ImportedLevel& level) {
  if (found.points_and_lines > 0) {
    level.notes.push_back(absl::StrCat(found.points_and_lines, " points and lines were skipped."));
  }
  if (triangles_left < found.triangles) {
    level.notes.push_back(absl::StrCat(found.triangles - triangles_left,
                                       " triangles of self-intersecting polygons could not be cut: the mesh has "
                                       "holes there, triangulate it before export."));
  }
  const double distance =
      std::max({std::abs(level.recentre[0]), std::abs(level.recentre[1]), std::abs(level.recentre[2])});
  if (distance > 0) {
    level.notes.push_back(
        absl::StrCat("Its coordinates are read as 32-bit floats: that far out they have steps of ",
                     std::nextafter(static_cast<float>(distance), HUGE_VALF) - static_cast<float>(distance),
                     "; export it near the origin to keep finer detail."));
  }
}

absl::StatusOr<ImportedLevel> import_faces(const LevelFiles& files, const ImportOptions& options) {
  // Check before parsing: assimp reads out of bounds on some files that this check refuses.
  ASSIGN_OR_RETURN(const std::optional<uint64_t> declared, check_bytes(files));
  Assimp::Importer importer;
  ASSIGN_OR_RETURN(const aiScene* const parsed, parse(importer, files));
  const FaceCounts found = count_faces(*parsed);
  RETURN_IF_ERROR(check_scene(*parsed, found, declared));
  const aiScene* scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (scene == nullptr)
    return refusal(absl::StrCat("cannot triangulate ", files.name, ": ", importer.GetErrorString()));

  LevelBuilder builder(options.scale);
  RETURN_IF_ERROR(add_nodes(*scene, builder));
  ASSIGN_OR_RETURN(ImportedLevel level, std::move(builder).finish(file_stem(files.name)));
  level.source_format = format_name(files.name);
  const FaceCounts left = count_faces(*scene);
  add_notes(found, left.faces - left.points_and_lines, level);
  return level;
}

}  // namespace

absl::StatusOr<ImportedLevel> import_scene(const LevelFiles& files, const ImportOptions& options) {
  if (lower_extension(files.name) == ".ply") {
    ASSIGN_OR_RETURN(std::optional<std::string> unpacked, unpack_ply_strips(files.bytes));
    if (unpacked.has_value()) return import_faces({files.name, *std::move(unpacked), {}}, options);
  }
  return import_faces(files, options);
}

}  // namespace locus::cli
