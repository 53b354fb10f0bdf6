#include "client/cli/levels/import/level_builder.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/levels/import/clean_text.h"
#include "client/cli/levels/import/import_error.h"
#include "client/cli/levels/import/import_limits.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

// A level is recentred if its distance from the origin is more than this factor times its size. At a factor of 8, float
// coordinates relative to the origin lose three of their 24 bits.
constexpr double kFarRatio = 8;

std::array<double, 3> choose_recentre(const std::array<double, 3>& min, const std::array<double, 3>& max) {
  std::array<double, 3> centre{};
  double extent = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    centre[axis] = (min[axis] + max[axis]) / 2;
    extent = std::max(extent, max[axis] - min[axis]);
  }
  const double distance = std::hypot(centre[0], centre[1], centre[2]);
  return distance > kFarRatio * extent ? centre : std::array<double, 3>{};
}

// Map from positions to vertex indices. Gives each distinct position one index, in order of first use, so that equal
// vertices are merged.
class VertexWelder {
 public:
  uint32_t index_of(const std::array<float, 3>& position) {
    std::array<uint32_t, 3> key;
    for (size_t axis = 0; axis < 3; ++axis) {
      key[axis] = std::bit_cast<uint32_t>(position[axis] + 0.0f);  // adding zero makes -0 equal to 0
    }
    const auto [entry, is_new] = indices_.try_emplace(key, static_cast<uint32_t>(indices_.size()));
    if (is_new) {
      for (uint32_t bits : key) vertices_.push_back(std::bit_cast<float>(bits));
    }
    return entry->second;
  }

  std::vector<float> take_vertices() { return std::move(vertices_); }

 private:
  absl::flat_hash_map<std::array<uint32_t, 3>, uint32_t> indices_;
  std::vector<float> vertices_;
};

}  // namespace

std::string clean_part_name(absl::string_view raw) { return clean_text(raw, kMaxPartNameBytes); }

void LevelBuilder::begin_part(absl::string_view name) {
  std::string clean = clean_part_name(name);
  if (!parts_.empty() && parts_.back().name == clean) return;
  if (!parts_.empty() && parts_.back().first_triangle == triangle_count()) parts_.pop_back();
  if (!parts_.empty() && parts_.back().name == clean) return;
  if (parts_.size() == kMaxImportParts) {
    parts_overflowed_ = true;
    return;
  }
  parts_.push_back({std::move(clean), static_cast<uint32_t>(triangle_count())});
}

absl::Status LevelBuilder::ensure_room(size_t vertices, size_t triangles) const {
  if (triangles > kMaxImportTriangles - triangle_count()) {
    return exceeds("the file", "more triangles", "triangles", kMaxImportTriangles, "split it into several files");
  }
  if (vertices > kMaxImportVertices - vertex_count()) {
    return exceeds("the file", "more vertices", "vertices", kMaxImportVertices, "split it into several files");
  }
  return absl::OkStatus();
}

uint32_t LevelBuilder::add_vertex(const std::array<double, 3>& position) {
  positions_.push_back({position[0] * scale_, position[1] * scale_, position[2] * scale_});
  return static_cast<uint32_t>(positions_.size() - 1);
}

void LevelBuilder::add_triangle(uint32_t a, uint32_t b, uint32_t c) {
  // Not LOCUS_DCHECK(): the importers do not link the core.
  assert(a < positions_.size() && b < positions_.size() && c < positions_.size());
  indices_.insert(indices_.end(), {a, b, c});
}

absl::StatusOr<LevelBuilder::Box> LevelBuilder::bounds() const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Box box{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
  for (uint32_t index : indices_) {
    const std::array<double, 3>& position = positions_[index];
    for (size_t axis = 0; axis < 3; ++axis) {
      // Negate the comparison, so that NaN is refused too.
      if (!(std::abs(position[axis]) <= kMaxImportCoordinate)) {
        return absl::InvalidArgumentError(
            absl::StrCat("vertex ", index, " is at (", position[0], ", ", position[1], ", ", position[2],
                         ") after scaling, coordinates must be finite and within ", kMaxImportCoordinate,
                         ": repair the file or give another scale"));
      }
      box.min[axis] = std::min(box.min[axis], position[axis]);
      box.max[axis] = std::max(box.max[axis], position[axis]);
    }
  }
  return box;
}

absl::StatusOr<ImportedLevel> LevelBuilder::finish(std::string name) && {
  if (indices_.empty()) {
    return absl::InvalidArgumentError("the file holds no triangle: export it with its faces, not as points or lines");
  }
  ASSIGN_OR_RETURN(const Box box, bounds());

  ImportedLevel level;
  level.recentre = choose_recentre(box.min, box.max);
  VertexWelder welder;
  for (uint32_t& index : indices_) {
    std::array<float, 3> rounded;
    for (size_t axis = 0; axis < 3; ++axis) {
      rounded[axis] = static_cast<float>(positions_[index][axis] - level.recentre[axis]);
    }
    index = welder.index_of(rounded);
  }
  if (!parts_.empty() && parts_.back().first_triangle == triangle_count()) parts_.pop_back();
  level.meshes.push_back({std::move(name), welder.take_vertices(), std::move(indices_), std::move(parts_)});

  if (level.recentre != std::array<double, 3>{}) {
    level.notes.push_back(
        absl::StrFormat("The file lies far from the origin: its vertices were moved by minus (%.12g, %.12g, %.12g); "
                        "instances with that translation stand where the file put them.",
                        level.recentre[0], level.recentre[1], level.recentre[2]));
  }
  if (parts_overflowed_) {
    level.notes.push_back(absl::StrCat("The file has more than ", kMaxImportParts,
                                       " parts: the last one holds the triangles of all that follow."));
  }
  return level;
}

}  // namespace locus::cli
