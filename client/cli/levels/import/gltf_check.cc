#include "client/cli/levels/import/gltf_check.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/levels/import/clean_text.h"
#include "client/cli/levels/import/import_error.h"
#include "client/cli/levels/import/import_limits.h"
#include "core/base/status_macros.h"
#include "nlohmann/json.hpp"

namespace locus::cli {
namespace {

constexpr size_t kMaxShownUri = 80;

absl::Status damaged_gltf(absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("damaged glTF: ", what, "; export the file again"));
}

// Handler of the JSON parser's events. It builds no tree of the document. It stores only the path to the current value,
// the children of the nodes, and the URIs of the buffers. A handler function that returns false ends the parsing; it
// has then set `status_`.
class GltfHandler final : public nlohmann::json_sax<nlohmann::json> {
 public:
  const absl::Status& status() const { return status_; }
  std::vector<std::vector<uint32_t>>& children() { return children_; }
  std::vector<std::string>& uris() { return uris_; }

  bool null() override { return next(); }
  bool boolean(bool /*value*/) override { return next(); }
  bool number_integer(number_integer_t /*value*/) override { return next(); }
  bool number_unsigned(number_unsigned_t value) override {
    const bool is_child = path_.size() == 4 && is_at("nodes") && path_[2].key == "children" && !children_.empty();
    if (!is_child) return next();
    if (++listed_children_ > kMaxSceneNodes) return refuse(too_many_nodes());
    // Clamp the index to 32 bits. An index beyond the last node is refused later.
    children_.back().push_back(static_cast<uint32_t>(std::min<uint64_t>(value, UINT32_MAX)));
    return next();
  }
  bool number_float(number_float_t /*value*/, const string_t& /*text*/) override { return next(); }
  bool string(string_t& value) override {
    if (path_.size() == 3 && is_at("buffers") && path_[2].key == "uri" && !take_uri(value)) return false;
    return next();
  }
  bool binary(binary_t& /*value*/) override { return next(); }

  bool start_object(std::size_t /*elements*/) override { return enter(); }
  bool key(string_t& value) override {
    path_.back().key = value.substr(0, kMaxReferenceBytes);
    return true;
  }
  bool end_object() override { return leave(); }
  bool start_array(std::size_t /*elements*/) override { return enter(); }
  bool end_array() override { return leave(); }
  bool parse_error(std::size_t position, const std::string& /*token*/,
                   const nlohmann::detail::exception& /*error*/) override {
    return refuse(damaged_gltf(absl::StrCat("no JSON at byte ", position)));
  }

 private:
  // Object or list that contains the current value. `key` is the key read last in an object, and empty in a list.
  struct Level {
    std::string key;
  };

  bool refuse(const absl::Status& status) {
    status_.Update(status);
    return false;
  }
  // Returns whether the current value lies in an element of the top-level list or object `list`.
  bool is_at(absl::string_view list) const { return path_.size() >= 2 && path_[0].key == list; }

  bool enter() {
    if (path_.size() == kMaxGltfDepth) {
      return refuse(exceeds("the JSON part", "deeper nesting", "gltf_depth", kMaxGltfDepth, "export the file again"));
    }
    if (path_.size() == 2 && is_at("nodes") && !add_node()) return false;
    if (path_.size() == 2 && is_at("meshes") && ++meshes_ > kMaxSceneMeshes) {
      return refuse(exceeds("the file", "more meshes", "scene_meshes", kMaxSceneMeshes, "join its meshes"));
    }
    path_.emplace_back();
    return true;
  }
  bool leave() {
    path_.pop_back();
    return next();
  }
  static bool next() { return true; }

  static absl::Status too_many_nodes() {
    return exceeds("the file", "more nodes", "scene_nodes", kMaxSceneNodes, "join its nodes");
  }

  bool add_node() {
    if (children_.size() == kMaxSceneNodes) return refuse(too_many_nodes());
    children_.emplace_back();
    return true;
  }

  bool take_uri(const std::string& uri) {
    if (absl::StartsWithIgnoreCase(uri, "data:")) {
      data_bytes_ += uri.size();
      if (data_bytes_ <= kMaxDataUriBytes) return true;
      return refuse(exceeds("the file", absl::StrCat(data_bytes_, " or more bytes in data: URIs"), "data_uri_bytes",
                            kMaxDataUriBytes, "export it as GLB"));
    }
    if (std::find(uris_.begin(), uris_.end(), uri) != uris_.end()) return true;
    if (uris_.size() == kMaxReferencedFiles) {
      return refuse(exceeds("the file", "references to more files", "referenced_files", kMaxReferencedFiles,
                            "export it as one GLB file"));
    }
    uris_.push_back(uri);
    return true;
  }

  absl::Status status_;
  std::vector<Level> path_;
  std::vector<std::vector<uint32_t>> children_;  // for each node, the indices of its children
  std::vector<std::string> uris_;
  size_t listed_children_ = 0;
  size_t meshes_ = 0;
  uint64_t data_bytes_ = 0;
};

// Checks that no node contains itself, that every node has at most one parent, and that the nesting is bounded. Visits
// the nodes from the roots down without recursion. O(nodes).
absl::Status check_nodes(const std::vector<std::vector<uint32_t>>& children) {
  std::vector<bool> has_parent(children.size());
  for (size_t node = 0; node < children.size(); ++node) {
    for (const uint32_t child : children[node]) {
      if (child >= children.size()) {
        return damaged_gltf(absl::StrCat("nodes[", node, "].children names node ", child, " of ", children.size()));
      }
      if (has_parent[child]) return damaged_gltf(absl::StrCat("node ", child, " has more than one parent"));
      has_parent[child] = true;
    }
  }
  std::vector<std::pair<uint32_t, size_t>> stack;  // node and its depth
  for (uint32_t node = 0; node < children.size(); ++node) {
    if (!has_parent[node]) stack.emplace_back(node, 1);
  }
  size_t visited = 0;
  while (!stack.empty()) {
    const auto [node, depth] = stack.back();
    stack.pop_back();
    ++visited;
    if (depth > kMaxSceneDepth) {
      return exceeds("the scene", "deeper nesting of nodes", "scene_depth", kMaxSceneDepth, "flatten its nodes");
    }
    for (const uint32_t child : children[node]) stack.emplace_back(child, depth + 1);
  }
  if (visited < children.size()) return damaged_gltf("a node contains itself");
  return absl::OkStatus();
}

uint32_t read_word(absl::string_view bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value |= uint32_t{static_cast<uint8_t>(bytes[at + i])} << (8 * i);
  return value;
}

// Returns the JSON part of a file. In a GLB file of either version the JSON begins at byte 20, and its length is stored
// at byte 12. In version 2 a file header of 12 bytes (magic, version, length) is followed by a chunk header of 8 bytes
// (length of the JSON, type). Version 1 has one header of 20 bytes: magic, version, length, length of the JSON, format.
absl::StatusOr<absl::string_view> json_part(absl::string_view bytes) {
  constexpr size_t kHeader = 20;
  if (bytes.substr(0, 4) != "glTF") return bytes;
  if (bytes.size() < kHeader) return damaged_gltf("the file ends in its header");
  const uint32_t declared = read_word(bytes, 8);
  const uint32_t length = read_word(bytes, 12);
  if (declared > bytes.size()) {
    return damaged_gltf(absl::StrCat("it declares ", declared, " bytes, but has ", bytes.size()));
  }
  if (length > bytes.size() - kHeader) return damaged_gltf("the file ends in its JSON part");
  return bytes.substr(kHeader, length);
}

// Returns the value of two hexadecimal digits at the front of `text`, or -1.
int hex_byte(absl::string_view text) {
  if (text.size() < 2 || !absl::ascii_isxdigit(static_cast<unsigned char>(text[0])) ||
      !absl::ascii_isxdigit(static_cast<unsigned char>(text[1]))) {
    return -1;
  }
  const auto digit = [](char c) {
    return c <= '9' ? c - '0' : absl::ascii_tolower(static_cast<unsigned char>(c)) - 'a' + 10;
  };
  return 16 * digit(text[0]) + digit(text[1]);
}

std::string without_percents(absl::string_view uri) {
  std::string path;
  for (size_t i = 0; i < uri.size(); ++i) {
    const int byte = uri[i] == '%' ? hex_byte(uri.substr(i + 1)) : -1;
    path.push_back(byte < 0 ? uri[i] : static_cast<char>(byte));
    if (byte >= 0) i += 2;
  }
  return path;
}

}  // namespace

absl::StatusOr<std::vector<std::string>> check_gltf(absl::string_view bytes) {
  ASSIGN_OR_RETURN(const absl::string_view json, json_part(bytes));
  if (json.size() > kMaxGltfJsonBytes) {
    return exceeds("the JSON part", absl::StrCat(json.size(), " bytes"), "gltf_json_bytes", kMaxGltfJsonBytes,
                   "export the file as GLB");
  }
  GltfHandler handler;
  // Some programs pad the JSON part of a GLB file with zeros instead of blanks.
  const absl::string_view text = json.substr(0, json.find_last_not_of('\0') + 1);
  if (!nlohmann::json::sax_parse(text.begin(), text.end(), &handler)) return handler.status();
  RETURN_IF_ERROR(check_nodes(handler.children()));
  return std::move(handler.uris());
}

absl::StatusOr<std::string> path_of_reference(absl::string_view uri) {
  if (uri.size() > kMaxReferenceBytes) {
    return exceeds("a reference", absl::StrCat(uri.size(), " bytes"), "reference_bytes", kMaxReferenceBytes,
                   "rename the file");
  }
  std::string path = without_percents(uri);
  const std::vector<absl::string_view> names = absl::StrSplit(path, '/');
  const bool has_control =
      std::any_of(path.begin(), path.end(), [](char c) { return absl::ascii_iscntrl(static_cast<unsigned char>(c)); });
  const bool leads_out = std::find(names.begin(), names.end(), "..") != names.end();
  if (path.empty() || path.front() == '/' || absl::StrContains(path, ':') || absl::StrContains(path, '\\') ||
      has_control || leads_out) {
    return absl::InvalidArgumentError(absl::StrCat(
        "the reference \"", clean_text(uri, kMaxShownUri),
        "\" is no relative path below the file's folder: put all files into one folder, or export the file as GLB"));
  }
  return path;
}

}  // namespace locus::cli
