#include "tests/bench/static/bench_mesh.h"

#include <cmath>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/levels/generate/blob.h"
#include "client/cli/levels/generate/city.h"
#include "client/cli/levels/generate/terrain.h"
#include "client/cli/levels/import/import_file.h"
#include "core/mesh/triangle_mesh.h"

namespace locus::bench {
namespace {

constexpr uint64_t kDefaultSeed = 7;

struct Kind {
  const char* name;
  cli::ImportedMesh (*generate)(uint64_t triangles, uint64_t seed);
  uint64_t max_triangles;
};

constexpr Kind kKinds[] = {{"city", cli::generate_city, cli::kMaxCityTriangles},
                           {"terrain", cli::generate_terrain, cli::kMaxTerrainTriangles},
                           {"blob", cli::generate_blob, cli::kMaxBlobTriangles}};

const Kind* kind_named(const std::string& name) {
  for (const Kind& kind : kKinds)
    if (kind.name == name) return &kind;
  return nullptr;
}

Vec3f vertex(const cli::ImportedMesh& mesh, size_t corner) {
  const float* const at = &mesh.vertices[size_t{3} * mesh.indices[corner]];
  return {at[0], at[1], at[2]};
}

void append(const cli::ImportedMesh& mesh, BenchMesh& result) {
  const auto first_vertex = static_cast<uint32_t>(result.vertices.size() / 3);
  result.vertices.insert(result.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
  for (size_t corner = 0; corner + 2 < mesh.indices.size(); corner += 3) {
    const auto number = static_cast<uint32_t>(result.triangles.size());
    const Triangle triangle = {vertex(mesh, corner), vertex(mesh, corner + 1), vertex(mesh, corner + 2), number};
    if (area_normal(triangle) == Vec3d{}) continue;
    result.triangles.push_back(triangle);
    for (size_t k = 0; k < 3; ++k) result.indices.push_back(first_vertex + mesh.indices[corner + k]);
  }
}

void measure(BenchMesh& mesh) {
  mesh.bounds = bounds_of(mesh.triangles.front());
  for (const Triangle& triangle : mesh.triangles) {
    mesh.bounds.min = min(mesh.bounds.min, bounds_of(triangle).min);
    mesh.bounds.max = max(mesh.bounds.max, bounds_of(triangle).max);
  }
  mesh.diagonal = static_cast<float>(std::sqrt(squared_length(to_double(mesh.bounds.max - mesh.bounds.min))));
}

std::string rounded_count(uint64_t triangles) {
  return triangles >= 1000 ? absl::StrCat(triangles / 1000, "k") : absl::StrCat(triangles);
}

absl::StatusOr<BenchMesh> generated(const Kind& kind, const std::vector<std::string>& words) {
  uint64_t triangles = 0;
  uint64_t seed = kDefaultSeed;
  const bool read = words.size() <= 3 && absl::SimpleAtoi(words[1], &triangles) && triangles > 0 &&
                    triangles <= kind.max_triangles && (words.size() < 3 || absl::SimpleAtoi(words[2], &seed));
  if (!read) {
    return absl::InvalidArgumentError(absl::StrCat("a generated mesh is ", kind.name, ":TRIANGLES or ", kind.name,
                                                   ":TRIANGLES:SEED, TRIANGLES from 1 to ", kind.max_triangles));
  }
  std::string name = absl::StrCat(kind.name, "-", rounded_count(triangles));
  if (seed != kDefaultSeed) absl::StrAppend(&name, "-", seed);
  return bench_mesh(name, {kind.generate(triangles, seed)});
}

// Returns the last part of a path, without its extension.
std::string stem(const std::string& path) {
  const std::string file = path.substr(path.find_last_of('/') + 1);
  return file.substr(0, file.find_last_of('.'));
}

}  // namespace

absl::StatusOr<BenchMesh> bench_mesh(const std::string& name, const std::vector<cli::ImportedMesh>& meshes) {
  BenchMesh result;
  result.name = name;
  for (const cli::ImportedMesh& mesh : meshes) append(mesh, result);
  if (result.triangles.empty()) return absl::InvalidArgumentError(absl::StrCat(name, ": no triangle has an area"));
  const auto valid = TriangleMesh::create(result.vertices, result.indices, {});
  if (!valid.ok()) return absl::Status(valid.status().code(), absl::StrCat(name, ": ", valid.status().message()));
  measure(result);
  return result;
}

absl::StatusOr<BenchMesh> load_mesh(const std::string& mesh) {
  const std::vector<std::string> words = absl::StrSplit(mesh, ':');
  const Kind* const kind = kind_named(words[0]);
  if (kind != nullptr && words.size() > 1) return generated(*kind, words);
  const size_t mark = mesh.find('#');
  const std::string path = mesh.substr(0, mark);
  cli::ImportOptions options;
  if (mark != std::string::npos) options.entry = mesh.substr(mark + 1);
  absl::StatusOr<cli::ImportedLevel> level = cli::import_file(path, options);
  if (!level.ok()) return level.status();
  return bench_mesh(stem(options.entry.empty() ? path : options.entry), level->meshes);
}

}  // namespace locus::bench
