// Reads where an item of an update batch is to be: its position, relative to the batch's frame or absolute, and its
// rotation, with the checks that every such number passes. Borrows the columns; one item after the other.
#ifndef LOCUS_CORE_SCENE_POSE_READER_H_
#define LOCUS_CORE_SCENE_POSE_READER_H_

#include "absl/types/span.h"
#include "core/base/column.h"
#include "core/base/refusal.h"
#include "core/geometry/rotation.h"

namespace locus {

class PoseReader {
 public:
  // The columns have passed check_form(); one of the first two is given.
  PoseReader(Vec3d frame, absl::Span<const float> positions, absl::Span<const double> positions_f64,
             absl::Span<const float> rotations)
      : frame_(frame), positions_(positions, 3), positions_f64_(positions_f64, 3), rotations_(rotations, 4) {}

  // "positions" or "positions_f64", and "rotations".
  const char* position_column() const { return positions_f64_.given() ? "positions_f64" : "positions"; }
  static constexpr char kRotationColumn[] = "rotations";
  bool turns() const { return rotations_.given(); }

  // What is wrong with item i's numbers, or Reason::kUnspecified and the pose. The rotation is made unit.
  Reason read_position(size_t i, Vec3d& position) const;
  Reason read_rotation(size_t i, Quaternion& rotation) const;  // only where turns()

 private:
  Vec3d frame_;
  ColumnReader<float> positions_;
  ColumnReader<double> positions_f64_;
  ColumnReader<float> rotations_;
};

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_POSE_READER_H_
