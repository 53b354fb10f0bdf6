#include "client/cli/levels/import/level_codec.h"

#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/levels/import/clean_text.h"
#include "client/cli/levels/import/import_limits.h"

namespace locus::cli {
namespace {

static_assert(std::endian::native == std::endian::little, "columns are written in memory order");

constexpr uint32_t kAnswerMark = 0x314c564c;
constexpr uint32_t kMaxMeshes = 16;  // importers return one mesh

class AnswerWriter {
 public:
  template <class T>
  void number(T value) {
    static_assert(std::is_arithmetic_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
  }
  void text(absl::string_view raw) {
    const std::string text = clean_text(raw, kMaxImportTextBytes);
    number(static_cast<uint32_t>(text.size()));
    bytes_ += text;
  }
  template <class T>
  void column(const std::vector<T>& values) {
    number(uint64_t{values.size()});
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Reader that returns zeros and empty values once an error has occurred.
class AnswerReader {
 public:
  explicit AnswerReader(absl::string_view bytes) : rest_(bytes) {}

  template <class T>
  T number() {
    T value{};
    const absl::string_view bytes = take(sizeof(T));
    if (bytes.size() == sizeof(T)) std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }
  uint32_t number_upto(uint32_t max) {
    const auto value = number<uint32_t>();
    if (value > max) good_ = false;
    return good_ ? value : 0;
  }
  std::string text() { return clean_text(take(number_upto(kMaxImportTextBytes)), kMaxImportTextBytes); }
  // Reads a column with three values per entry.
  template <class T>
  std::vector<T> column(uint64_t max_entries) {
    const auto count = number<uint64_t>();
    if (count > 3 * max_entries || count % 3 != 0 || count > rest_.size() / sizeof(T)) good_ = false;
    if (!good_) return {};
    const absl::string_view bytes = take(count * sizeof(T));
    std::vector<T> values(count);
    if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }
  void fail() { good_ = false; }
  bool good() const { return good_; }
  bool ended() const { return good_ && rest_.empty(); }

 private:
  absl::string_view take(size_t size) {
    if (size > rest_.size()) good_ = false;
    if (!good_) return {};
    const absl::string_view bytes = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return bytes;
  }

  absl::string_view rest_;
  bool good_ = true;
};

void write_mesh(const ImportedMesh& mesh, AnswerWriter& writer) {
  writer.text(mesh.name);
  writer.column(mesh.vertices);
  writer.column(mesh.indices);
  writer.number(static_cast<uint32_t>(mesh.parts.size()));
  for (const MeshPart& part : mesh.parts) {
    writer.number(part.first_triangle);
    writer.text(part.name);
  }
}

bool is_valid(const ImportedMesh& mesh) {
  bool valid = !mesh.indices.empty();
  // Allow twice the maximum: recentring moves a coordinate by up to the maximum.
  for (const float coordinate : mesh.vertices) valid &= std::abs(coordinate) <= 2 * kMaxImportCoordinate;
  for (const uint32_t index : mesh.indices) valid &= index < mesh.vertices.size() / 3;
  for (size_t i = 0; i < mesh.parts.size(); ++i) {
    valid &= mesh.parts[i].first_triangle < mesh.indices.size() / 3;
    valid &= mesh.parts[i].name.size() <= kMaxPartNameBytes;
    valid &= i == 0 || mesh.parts[i - 1].first_triangle < mesh.parts[i].first_triangle;
  }
  return valid;
}

ImportedMesh read_mesh(AnswerReader& reader) {
  ImportedMesh mesh;
  mesh.name = reader.text();
  mesh.vertices = reader.column<float>(kMaxImportVertices);
  mesh.indices = reader.column<uint32_t>(kMaxImportTriangles);
  const uint32_t parts = reader.number_upto(kMaxImportParts);
  for (uint32_t i = 0; i < parts && reader.good(); ++i) {
    MeshPart& part = mesh.parts.emplace_back();
    part.first_triangle = reader.number<uint32_t>();
    part.name = reader.text();
  }
  if (reader.good() && !is_valid(mesh)) reader.fail();
  return mesh;
}

ImportedLevel read_level(AnswerReader& reader) {
  ImportedLevel level;
  level.source_format = reader.text();
  for (double& coordinate : level.recentre) {
    coordinate = reader.number<double>();
    if (!(std::abs(coordinate) <= kMaxImportCoordinate)) reader.fail();
  }
  const uint32_t notes = reader.number_upto(kMaxImportNotes);
  for (uint32_t i = 0; i < notes && reader.good(); ++i) level.notes.push_back(reader.text());
  const uint32_t meshes = reader.number_upto(kMaxMeshes);
  for (uint32_t i = 0; i < meshes && reader.good(); ++i) level.meshes.push_back(read_mesh(reader));
  if (meshes == 0) reader.fail();
  return level;
}

// Returns whether importers return errors with this code.
bool is_import_error(absl::StatusCode code) {
  return code == absl::StatusCode::kInvalidArgument || code == absl::StatusCode::kNotFound ||
         code == absl::StatusCode::kResourceExhausted;
}

absl::Status damaged_answer() {
  return absl::InvalidArgumentError(
      "the importer gave a damaged answer: the file is damaged or made to do harm; export it again or convert it to "
      "GLB");
}

}  // namespace

std::string encode_level(const absl::StatusOr<ImportedLevel>& level) {
  AnswerWriter writer;
  writer.number(kAnswerMark);
  writer.number(static_cast<uint32_t>(level.status().code()));
  if (!level.ok()) {
    writer.text(level.status().message());
    return writer.take();
  }
  writer.text(level->source_format);
  for (const double coordinate : level->recentre) writer.number(coordinate);
  const size_t notes = std::min(level->notes.size(), kMaxImportNotes);
  writer.number(static_cast<uint32_t>(notes));
  for (size_t i = 0; i < notes; ++i) writer.text(level->notes[i]);
  writer.number(static_cast<uint32_t>(level->meshes.size()));
  for (const ImportedMesh& mesh : level->meshes) write_mesh(mesh, writer);
  return writer.take();
}

absl::StatusOr<ImportedLevel> decode_level(absl::string_view bytes) {
  AnswerReader reader(bytes);
  if (reader.number<uint32_t>() != kAnswerMark) return damaged_answer();
  const auto code = static_cast<absl::StatusCode>(reader.number<uint32_t>());
  if (code != absl::StatusCode::kOk) {
    const std::string message = reader.text();
    if (!reader.ended() || message.empty() || !is_import_error(code)) return damaged_answer();
    return absl::Status(code, message);
  }
  ImportedLevel level = read_level(reader);
  if (!reader.ended()) return damaged_answer();
  return level;
}

}  // namespace locus::cli
