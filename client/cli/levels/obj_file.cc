#include "client/cli/levels/obj_file.h"

#include <array>
#include <charconv>

namespace locus::cli {
namespace {

void write_float(std::ostream& out, float value) {
  std::array<char, 32> text{};
  const std::to_chars_result end = std::to_chars(text.data(), text.data() + text.size(), value);
  out.write(text.data(), end.ptr - text.data());
}

}  // namespace

void write_obj(std::ostream& out, const ImportedMesh& mesh) {
  out << "o " << mesh.name << '\n';
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    out << (i % 3 == 0 ? "v " : " ");
    write_float(out, mesh.vertices[i]);
    if (i % 3 == 2) out << '\n';
  }
  size_t part = 0;
  for (size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    while (part < mesh.parts.size() && mesh.parts[part].first_triangle * size_t{3} <= i) {
      out << "g " << mesh.parts[part++].name << '\n';
    }
    out << "f " << mesh.indices[i] + 1 << ' ' << mesh.indices[i + 1] + 1 << ' ' << mesh.indices[i + 2] + 1 << '\n';
  }
}

}  // namespace locus::cli
