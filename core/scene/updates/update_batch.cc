#include "core/scene/updates/update_batch.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/column.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"

namespace locus {
namespace {

// Checks the column lengths of one element of a batch, such as inserts[2]. `list` is the name of the list, `index` the
// index of the element, and `items` its number of items.
class ElementCheck {
 public:
  ElementCheck(absl::string_view list, size_t index, size_t items) : list_(list), index_(index), items_(items) {}

  absl::Status run(const InsertColumns& insert) const {
    RETURN_IF_ERROR(check_positions(insert.positions, insert.positions_f64));
    RETURN_IF_ERROR(check_length(insert.rotations.size(), 4, ColumnNeed::kOptional, "rotations"));
    RETURN_IF_ERROR(check_shape(insert));
    return check_labels(insert);
  }

  absl::Status run(const MoveColumns& move) const {
    RETURN_IF_ERROR(check_positions(move.positions, move.positions_f64));
    return check_length(move.rotations.size(), 4, ColumnNeed::kOptional, "rotations");
  }

  absl::Status run(const RelabelColumns& relabel) const { return check_labels(relabel); }

  absl::Status run(const InstanceMoveColumns& move) const {
    RETURN_IF_ERROR(check_positions(move.positions, move.positions_f64));
    RETURN_IF_ERROR(check_length(move.rotations.size(), 4, ColumnNeed::kOptional, "rotations"));
    return check_length(move.scales.size(), 1, ColumnNeed::kOptional, "scales");
  }

 private:
  absl::Status check_length(size_t values, size_t width, ColumnNeed need, absl::string_view column) const {
    return check_column(values, width, items_, need, {list_, index_, column});
  }

  absl::Status check_positions(absl::Span<const float> relative, absl::Span<const double> absolute) const {
    if (!relative.empty() && !absolute.empty())
      return refuse_argument(Reason::kMalformed, ColumnName{list_, index_, "positions_f64"}.text(), {},
                             "give positions or positions_f64, not both");
    if (absolute.empty()) return check_length(relative.size(), 3, ColumnNeed::kEachOrOne, "positions");
    return check_length(absolute.size(), 3, ColumnNeed::kEachOrOne, "positions_f64");
  }

  absl::Status check_shape(const InsertColumns& insert) const {
    switch (insert.kind) {
      case ShapeKind::kPoint:
        return absl::OkStatus();
      case ShapeKind::kBall:
        return check_length(insert.radii.size(), 1, ColumnNeed::kEachOrOne, "ball.radii");
      case ShapeKind::kBox:
        return check_length(insert.extents.size(), 3, ColumnNeed::kEachOrOne, "box.half_extents");
      case ShapeKind::kCapsule:
        break;
    }
    RETURN_IF_ERROR(check_length(insert.radii.size(), 1, ColumnNeed::kEachOrOne, "capsule.radii"));
    return check_length(insert.extents.size(), 3, ColumnNeed::kEachOrOne, "capsule.half_axes");
  }

  template <class Columns>
  absl::Status check_labels(const Columns& columns) const {
    RETURN_IF_ERROR(check_length(columns.layers.size(), 1, ColumnNeed::kOptional, "layers"));
    RETURN_IF_ERROR(check_length(columns.groups.size(), 1, ColumnNeed::kOptional, "groups"));
    return check_length(columns.tags.size(), 1, ColumnNeed::kOptional, "tags");
  }

  const absl::string_view list_;
  const size_t index_;
  const size_t items_;
};

template <class Columns>
absl::Status check_list(absl::string_view list, const std::vector<Columns>& elements) {
  for (size_t i = 0; i < elements.size(); ++i)
    RETURN_IF_ERROR(ElementCheck(list, i, elements[i].ids.size()).run(elements[i]));
  return absl::OkStatus();
}

size_t item_count(const UpdateBatch& batch) {
  size_t items = batch.remove_ids.size() + batch.remove_groups.size();
  for (const InsertColumns& insert : batch.inserts) items += insert.ids.size();
  for (const MoveColumns& move : batch.moves) items += move.ids.size();
  for (const RelabelColumns& relabel : batch.relabels) items += relabel.ids.size();
  for (const InstanceMoveColumns& move : batch.instance_moves) items += move.ids.size();
  for (const RelabelColumns& relabel : batch.instance_relabels) items += relabel.ids.size();
  return items;
}

absl::Status check_header(const UpdateBatch& batch) {
  if (!is_finite(batch.frame)) return refuse_argument(Reason::kNotFinite, "frame", {}, "a frame needs finite numbers");
  if (max_component(abs(batch.frame)) > limits::kMaxCoordinate)
    return refuse_argument(Reason::kOutOfRange, "frame", {}, "frames must lie within +-1e9");
  if ((batch.writer == 0) != (batch.batch == 0))
    return refuse_argument(Reason::kMalformed, batch.writer == 0 ? "writer" : "batch", {},
                           "writer and batch go together: a random number that is not 0, and 1, 2, 3, ...");
  const size_t items = item_count(batch);
  if (items > limits::kMaxUpdateItems)
    return refuse_limit("batch", "update_items", limits::kMaxUpdateItems, static_cast<double>(items));
  return absl::OkStatus();
}

bool only_moves(const UpdateBatch& batch) {
  if (batch.clear || batch.restart_ticks || batch.all_or_nothing || batch.moves.empty()) return false;
  if (!batch.remove_ids.empty() || !batch.remove_groups.empty() || !batch.inserts.empty() || !batch.relabels.empty())
    return false;
  if (has_instances(batch)) return false;
  return std::none_of(batch.moves.begin(), batch.moves.end(), [](const MoveColumns& move) { return move.teleport; });
}

}  // namespace

bool may_join(const UpdateBatch& first, const UpdateBatch& second) {
  return first.tick == second.tick && only_moves(first) && only_moves(second);
}

absl::Status check_form(const UpdateBatch& batch) {
  RETURN_IF_ERROR(check_header(batch));
  RETURN_IF_ERROR(check_list("inserts", batch.inserts));
  RETURN_IF_ERROR(check_list("moves", batch.moves));
  RETURN_IF_ERROR(check_list("relabels", batch.relabels));
  RETURN_IF_ERROR(check_list("instance_moves", batch.instance_moves));
  return check_list("instance_relabels", batch.instance_relabels);
}

}  // namespace locus
