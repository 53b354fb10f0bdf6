#include "client/cli/levels/export/glb_writer.h"

#include <algorithm>
#include <bit>
#include <cstdio>
#include <fstream>
#include <limits>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

static_assert(std::endian::native == std::endian::little, "columns are written as they lie in memory");

// Constants of the glTF specification: the header's magic number and version, and the types of the two chunks.
constexpr uint32_t kMagic = 0x46546C67;
constexpr uint32_t kVersion = 2;
constexpr uint32_t kJsonChunk = 0x4E4F534A;
constexpr uint32_t kBinaryChunk = 0x004E4942;
constexpr uint64_t kFrameBytes = 12 + 8 + 8;
constexpr int kFloat = 5126;
constexpr int kUnsignedInt = 5125;
constexpr int kVertexTarget = 34962;
constexpr int kIndexTarget = 34963;
constexpr uint32_t kNoVertex = std::numeric_limits<uint32_t>::max();

absl::Status too_large(uint64_t bytes) {
  return absl::ResourceExhaustedError(absl::StrCat("the file would have at least ", bytes,
                                                   " bytes; a GLB file has at most ", kMaxExportBytes,
                                                   " (export_bytes): export fewer meshes"));
}

Json place_json(const std::string& name, const GlbPlace& place) {
  Json node = {{"name", name}};
  if (place.translation != std::array<float, 3>{}) node["translation"] = floats_json(place.translation);
  if (place.rotation != std::array<float, 4>{0, 0, 0, 1}) node["rotation"] = floats_json(place.rotation);
  if (place.scale != std::array<float, 3>{1, 1, 1}) node["scale"] = floats_json(place.scale);
  return node;
}

// Returns a bright colour that depends only on `name`, so that a material has the same colour in all files. Method: the
// bytes of a Fowler, Noll, Vo hash (FNV-1a) of the name.
Json colour_of(const std::string& name) {
  uint32_t hash = 2166136261u;
  for (const char byte : name) hash = (hash ^ static_cast<uint8_t>(byte)) * 16777619u;
  Json colour = Json::array();
  for (int channel = 0; channel < 3; ++channel) colour.push_back(0.35 + (hash >> (8 * channel) & 0xFF) / 512.0);
  colour.push_back(1);
  return colour;
}

void put(std::ostream& out, uint32_t value) { out.write(reinterpret_cast<const char*>(&value), sizeof value); }

}  // namespace

GlbWriter::GlbWriter(const std::string& root_name, UpAxis up) : root_({{"name", root_name}}) {
  // Matrix in column order that rotates z-up to y-up coordinates: x stays x, y becomes -z, z becomes y.
  if (up == UpAxis::kZ) root_["matrix"] = {1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1};
}

size_t GlbWriter::reserve_mesh() {
  meshes_.emplace_back();
  return meshes_.size() - 1;
}

size_t GlbWriter::add_view(const void* data, size_t bytes, int target) {
  views_.push_back({{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes}, {"target", target}});
  bytes_.append(static_cast<const char*>(data), bytes);
  return views_.size() - 1;
}

size_t GlbWriter::material(const std::string& name) {
  const auto [entry, is_new] = material_numbers_.try_emplace(name, materials_.size());
  if (is_new) {
    materials_.push_back({{"name", name},
                          {"pbrMetallicRoughness",
                           {{"baseColorFactor", colour_of(name)}, {"metallicFactor", 0}, {"roughnessFactor", 1}}},
                          {"doubleSided", true}});
  }
  return entry->second;
}

Json GlbWriter::add_primitive(const ImportedMesh& mesh, size_t first_index, size_t end_index,
                              const std::string& material_name) {
  std::vector<float> vertices;
  std::vector<uint32_t> indices;
  std::vector<uint32_t> used;
  indices.reserve(end_index - first_index);
  std::array<float, 3> low;
  std::array<float, 3> high;
  low.fill(std::numeric_limits<float>::infinity());
  high.fill(-std::numeric_limits<float>::infinity());
  for (size_t i = first_index; i < end_index; ++i) {
    uint32_t& local_index = renumbered_[mesh.indices[i]];
    if (local_index == kNoVertex) {
      local_index = static_cast<uint32_t>(used.size());
      used.push_back(mesh.indices[i]);
      for (size_t axis = 0; axis < 3; ++axis) {
        const float coordinate = mesh.vertices[size_t{3} * mesh.indices[i] + axis];
        vertices.push_back(coordinate);
        low[axis] = std::min(low[axis], coordinate);
        high[axis] = std::max(high[axis], coordinate);
      }
    }
    indices.push_back(local_index);
  }
  for (const uint32_t vertex : used) renumbered_[vertex] = kNoVertex;
  const size_t vertex_view = add_view(vertices.data(), vertices.size() * sizeof(float), kVertexTarget);
  accessors_.push_back({{"bufferView", vertex_view},
                        {"componentType", kFloat},
                        {"count", used.size()},
                        {"type", "VEC3"},
                        {"min", floats_json(low)},
                        {"max", floats_json(high)}});
  const size_t index_view = add_view(indices.data(), indices.size() * sizeof(uint32_t), kIndexTarget);
  accessors_.push_back(
      {{"bufferView", index_view}, {"componentType", kUnsignedInt}, {"count", indices.size()}, {"type", "SCALAR"}});
  return {{"attributes", {{"POSITION", accessors_.size() - 2}}},
          {"indices", accessors_.size() - 1},
          {"material", material(material_name)}};
}

absl::Status GlbWriter::set_mesh(size_t mesh_index, const ImportedMesh& mesh) {
  LOCUS_DCHECK_LT(mesh_index, meshes_.size());
  // Check the size before copying. `bytes` is only an estimate of the file's size, because vertices that several parts
  // share are copied once for each of these parts, and unused vertices are not copied.
  const uint64_t bytes = bytes_.size() + (mesh.vertices.size() + mesh.indices.size()) * sizeof(float) + kFrameBytes;
  if (bytes > kMaxExportBytes) return too_large(bytes);
  renumbered_.assign(mesh.vertices.size() / 3, kNoVertex);
  std::vector<MeshPart> parts = mesh.parts;
  if (parts.empty() || parts.size() > kMaxExportParts) parts = {{mesh.name, 0}};
  Json primitives = Json::array();
  for (size_t part = 0; part < parts.size(); ++part) {
    const size_t first = size_t{3} * parts[part].first_triangle;
    const size_t end = part + 1 < parts.size() ? size_t{3} * parts[part + 1].first_triangle : mesh.indices.size();
    primitives.push_back(add_primitive(mesh, first, end, parts[part].name));
  }
  meshes_[mesh_index] = {{"name", mesh.name}, {"primitives", std::move(primitives)}};
  if (bytes_.size() + kFrameBytes > kMaxExportBytes) return too_large(bytes_.size() + kFrameBytes);
  return absl::OkStatus();
}

absl::Status GlbWriter::ensure_room(size_t nodes) const {
  if (node_count_ + nodes <= kMaxExportNodes) return absl::OkStatus();
  return absl::ResourceExhaustedError(absl::StrCat("a file has at most ", kMaxExportNodes,
                                                   " nodes (export_nodes), a capsule takes four: export fewer things, "
                                                   "for example with --instances"));
}

void GlbWriter::append_node(const Json& node) {
  absl::StrAppend(&nodes_, ",", json_line(node));
  ++node_count_;
}

absl::Status GlbWriter::add_node(const std::string& name, const GlbPlace& place, size_t mesh, const Json& extras) {
  LOCUS_DCHECK_LT(mesh, meshes_.size());
  RETURN_IF_ERROR(ensure_room(1));
  Json node = place_json(name, place);
  node["mesh"] = mesh;
  if (!extras.empty()) node["extras"] = extras;
  top_.push_back(node_count_);
  append_node(node);
  return absl::OkStatus();
}

absl::Status GlbWriter::add_group(const std::string& name, const GlbPlace& place, const std::vector<Child>& children,
                                  const Json& extras) {
  RETURN_IF_ERROR(ensure_room(1 + children.size()));
  Json node = place_json(name, place);
  node["children"] = Json::array();
  for (size_t i = 0; i < children.size(); ++i) node["children"].push_back(node_count_ + 1 + i);
  if (!extras.empty()) node["extras"] = extras;
  top_.push_back(node_count_);
  append_node(node);
  for (const Child& child : children) {
    Json drawing = place_json(name, child.place);
    LOCUS_DCHECK_LT(child.mesh, meshes_.size());
    drawing["mesh"] = child.mesh;
    append_node(drawing);
  }
  return absl::OkStatus();
}

std::string GlbWriter::json() const {
  Json root = root_;
  root["children"] = top_;
  const Json head = {{"version", "2.0"}, {"generator", "locus"}};
  std::string text = absl::StrCat(R"({"asset":)", json_line(head), R"(,"scene":0,"scenes":[{"nodes":[0]}],"nodes":[)",
                                  json_line(root), nodes_, R"(],"meshes":[)");
  absl::StrAppend(&text, absl::StrJoin(meshes_, ",", [](std::string* out, const Json& mesh) {
    absl::StrAppend(out, json_line(mesh));
  }));
  const Json buffers = Json::array({{{"byteLength", bytes_.size()}}});
  absl::StrAppend(&text, R"(],"materials":)", json_line(materials_), R"(,"accessors":)", json_line(accessors_),
                  R"(,"bufferViews":)", json_line(views_), R"(,"buffers":)", json_line(buffers), "}");
  text.resize((text.size() + 3) / 4 * 4, ' ');
  return text;
}

absl::StatusOr<uint64_t> GlbWriter::write(const std::string& path) const {
  for (const Json& mesh : meshes_) LOCUS_DCHECK(!mesh.is_null());
  const std::string text = json();
  const uint64_t bytes = kFrameBytes + text.size() + bytes_.size();
  if (bytes > kMaxExportBytes) return too_large(bytes);
  const std::string unfinished = path + ".unfinished";
  std::ofstream out(unfinished, std::ios::binary | std::ios::trunc);
  for (const uint32_t word :
       {kMagic, kVersion, static_cast<uint32_t>(bytes), static_cast<uint32_t>(text.size()), kJsonChunk})
    put(out, word);
  out << text;
  put(out, static_cast<uint32_t>(bytes_.size()));
  put(out, kBinaryChunk);
  out << bytes_;
  out.close();
  if (!out || std::rename(unfinished.c_str(), path.c_str()) != 0) {
    std::remove(unfinished.c_str());
    return absl::FailedPreconditionError(absl::StrCat("cannot write ", path, ": check its folder and space"));
  }
  return bytes;
}

}  // namespace locus::cli
