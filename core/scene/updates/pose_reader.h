// Reads where an item of an update batch is to be: its position, relative to the batch's frame or absolute, and its
// rotation, with the checks that every such number passes. Borrows the columns; one item after the other.
#ifndef LOCUS_CORE_SCENE_UPDATES_POSE_READER_H_
#define LOCUS_CORE_SCENE_UPDATES_POSE_READER_H_

#include <algorithm>

#include "absl/types/span.h"
#include "core/base/column.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/geometry/rotation.h"

namespace locus {

class PoseReader {
 public:
  // The columns have passed check_form(); one of the first two is given.
  PoseReader(Vec3d frame, absl::Span<const float> positions, absl::Span<const double> positions_f64,
             absl::Span<const float> rotations)
      : frame_(frame),
        relative_(positions.data()),
        absolute_(positions_f64.empty() ? nullptr : positions_f64.data()),
        stride_(std::max(positions.size(), positions_f64.size()) == 3 ? 0 : 3),
        rotations_(rotations, 4) {}

  // "positions" or "positions_f64", and "rotations".
  const char* position_column() const { return absolute_ != nullptr ? "positions_f64" : "positions"; }
  static constexpr char kRotationColumn[] = "rotations";
  bool turns() const { return rotations_.given(); }

  // What is wrong with item i's numbers, or Reason::kUnspecified and the pose. The rotation is made unit.
  Reason read_position(size_t i, Vec3d& position) const {
    const size_t at = i * stride_;
    position = absolute_ != nullptr ? Vec3d{absolute_[at], absolute_[at + 1], absolute_[at + 2]}
                                    : frame_ + Vec3d{relative_[at], relative_[at + 1], relative_[at + 2]};
    // NaN fails, too.
    const Vec3d distance = abs(position);
    const bool right = (distance.x <= limits::kMaxCoordinate) & (distance.y <= limits::kMaxCoordinate) &
                       (distance.z <= limits::kMaxCoordinate);
    return right ? Reason::kUnspecified : is_finite(position) ? Reason::kOutOfRange : Reason::kNotFinite;
  }
  Reason read_rotation(size_t i, Quaternion& rotation) const;  // only where turns()

 private:
  Vec3d frame_;
  const float* relative_;
  const double* absolute_;  // null where positions are relative
  size_t stride_;           // 0: one entry for all
  ColumnReader<float> rotations_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_POSE_READER_H_
