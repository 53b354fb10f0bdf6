// Reads the position and rotation of the items of an update batch and checks their values. Positions are absolute or
// relative to the frame of the batch. Borrows the columns.
#ifndef LOCUS_CORE_SCENE_UPDATES_POSE_READER_H_
#define LOCUS_CORE_SCENE_UPDATES_POSE_READER_H_

#include <algorithm>

#include "absl/types/span.h"
#include "core/base/check.h"
#include "core/base/column.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/geometry/rotation.h"

namespace locus {

// Reads a quaternion x, y, z, w and normalizes it. Returns Reason::kUnspecified, or the reason why the values are
// refused.
Reason read_quaternion(const float* values, Quaternion& rotation);

class PoseReader {
 public:
  // Precondition: the columns have passed check_form(), and one of the two position columns has entries unless there
  // are no items.
  PoseReader(Vec3d frame, absl::Span<const float> positions, absl::Span<const double> positions_f64,
             absl::Span<const float> rotations)
      : frame_(frame),
        relative_(positions.data()),
        absolute_(positions_f64.empty() ? nullptr : positions_f64.data()),
        stride_(std::max(positions.size(), positions_f64.size()) == 3 ? 0 : 3),
        rotations_(rotations, 4) {}

  // Returns the name of the position column that is used, for errors.
  const char* position_column() const { return absolute_ != nullptr ? "positions_f64" : "positions"; }
  static constexpr char kRotationColumn[] = "rotations";
  bool has_rotations() const { return rotations_.given(); }

  // Read the position or rotation of item `i`. Return Reason::kUnspecified, or the reason why the values of the item
  // are refused. A rotation is normalized. read_rotation() requires has_rotations().
  Reason read_position(size_t i, Vec3d& position) const {
    LOCUS_DCHECK(relative_ != nullptr || absolute_ != nullptr);
    const size_t at = i * stride_;
    position = absolute_ != nullptr ? Vec3d{absolute_[at], absolute_[at + 1], absolute_[at + 2]}
                                    : frame_ + Vec3d{relative_[at], relative_[at + 1], relative_[at + 2]};
    // NaN fails this comparison, too.
    const Vec3d distance = abs(position);
    const bool valid = (distance.x <= limits::kMaxCoordinate) & (distance.y <= limits::kMaxCoordinate) &
                       (distance.z <= limits::kMaxCoordinate);
    return valid ? Reason::kUnspecified : is_finite(position) ? Reason::kOutOfRange : Reason::kNotFinite;
  }
  Reason read_rotation(size_t i, Quaternion& rotation) const {
    LOCUS_DCHECK(has_rotations());
    return read_quaternion(rotations_.entry(i), rotation);
  }

 private:
  Vec3d frame_;
  const float* relative_;
  const double* absolute_;  // null if positions are relative
  size_t stride_;           // number of values from one item to the next; 0: one entry for all items
  ColumnReader<float> rotations_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_UPDATES_POSE_READER_H_
