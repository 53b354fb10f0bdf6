// Parts of compounds, and poses of parts, as JSON lists. For options, bulk rows and dumps. Functions without state.
//
// A part is {"ball": R}, {"box": [X,Y,Z]} or {"capsule": {"axis": [X,Y,Z], "radius": R}}, with "at" and optionally
// "rotation" and "layers". A pose is {"at": [X,Y,Z]}, {"rotation": [X,Y,Z,W]} or both.
#ifndef LOCUS_CLIENT_CLI_ROWS_PART_LIST_H_
#define LOCUS_CLIENT_CLI_ROWS_PART_LIST_H_

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "client/cli/output.h"
#include "client/lib/compound.h"

namespace locus::cli {

// Reads the parts of a compound, 1 to 64. Errors are INVALID_ARGUMENT and name the part.
absl::StatusOr<client::Compound> read_parts(absl::string_view text);

// Columns of Move for one object; a column is empty if no part has the value.
struct PoseColumns {
  uint32_t parts_each = 0;
  std::vector<float> positions = {};
  std::vector<float> rotations = {};
};

// Reads the poses of all parts of a compound. Either all or none of them have "at", and the same holds for "rotation".
absl::StatusOr<PoseColumns> read_poses(absl::string_view text);

// One part of a compound.
struct PartRow {
  v1::Parts::ShapeCase shape = v1::Parts::SHAPE_NOT_SET;
  std::array<float, 3> at{};
  std::array<float, 4> rotation{0, 0, 0, 1};
  float radius = 0;             // ball, capsule
  std::array<float, 3> size{};  // box: half extents; capsule: half axis
  uint32_t layers = client::kAllLayers;
};

// Calls `take` for each part in order. Returns false if a column has the wrong number of entries.
bool for_each_part(const v1::Compound& compound, const std::function<void(const PartRow&)>& take);

// Returns the parts as a list that read_parts() reads.
Json parts_json(const v1::Compound& compound);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ROWS_PART_LIST_H_
