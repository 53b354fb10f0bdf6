#include "core/scene/updates/update_batch.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/column.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"

namespace locus {
namespace {

absl::Status check_positions(absl::Span<const float> relative, absl::Span<const double> absolute, size_t n,
                             const std::string& field) {
  if (!relative.empty() && !absolute.empty())
    return refuse_argument(Reason::kMalformed, field + ".positions_f64", {},
                           "give positions or positions_f64, not both");
  if (absolute.empty()) return check_column(relative.size(), 3, n, ColumnNeed::kEachOrOne, field + ".positions");
  return check_column(absolute.size(), 3, n, ColumnNeed::kEachOrOne, field + ".positions_f64");
}

absl::Status check_shape(const InsertColumns& insert, size_t n, const std::string& field) {
  const bool has_radius = insert.kind == ShapeKind::kBall || insert.kind == ShapeKind::kCapsule;
  const bool has_extent = insert.kind == ShapeKind::kBox || insert.kind == ShapeKind::kCapsule;
  const std::string shape = field + (insert.kind == ShapeKind::kBall  ? ".ball"
                                     : insert.kind == ShapeKind::kBox ? ".box"
                                                                      : ".capsule");
  if (has_radius) RETURN_IF_ERROR(check_column(insert.radii.size(), 1, n, ColumnNeed::kEachOrOne, shape + ".radii"));
  if (!has_extent) return absl::OkStatus();
  return check_column(insert.extents.size(), 3, n, ColumnNeed::kEachOrOne,
                      shape + (insert.kind == ShapeKind::kBox ? ".half_extents" : ".half_axes"));
}

template <class Columns>
absl::Status check_labels(const Columns& columns, size_t n, const std::string& field) {
  RETURN_IF_ERROR(check_column(columns.layers.size(), 1, n, ColumnNeed::kOptional, field + ".layers"));
  RETURN_IF_ERROR(check_column(columns.groups.size(), 1, n, ColumnNeed::kOptional, field + ".groups"));
  return check_column(columns.tags.size(), 1, n, ColumnNeed::kOptional, field + ".tags");
}

absl::Status check_insert(const InsertColumns& insert, const std::string& field) {
  const size_t n = insert.ids.size();
  RETURN_IF_ERROR(check_positions(insert.positions, insert.positions_f64, n, field));
  RETURN_IF_ERROR(check_column(insert.rotations.size(), 4, n, ColumnNeed::kOptional, field + ".rotations"));
  RETURN_IF_ERROR(check_shape(insert, n, field));
  return check_labels(insert, n, field);
}

absl::Status check_move(const MoveColumns& move, const std::string& field) {
  const size_t n = move.ids.size();
  RETURN_IF_ERROR(check_positions(move.positions, move.positions_f64, n, field));
  return check_column(move.rotations.size(), 4, n, ColumnNeed::kOptional, field + ".rotations");
}

size_t item_count(const UpdateBatch& batch) {
  size_t items = batch.remove_ids.size() + batch.remove_groups.size();
  for (const InsertColumns& insert : batch.inserts) items += insert.ids.size();
  for (const MoveColumns& move : batch.moves) items += move.ids.size();
  for (const RelabelColumns& relabel : batch.relabels) items += relabel.ids.size();
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
  return std::none_of(batch.moves.begin(), batch.moves.end(), [](const MoveColumns& move) { return move.teleport; });
}

}  // namespace

bool may_join(const UpdateBatch& first, const UpdateBatch& second) {
  return first.tick == second.tick && only_moves(first) && only_moves(second);
}

absl::Status check_form(const UpdateBatch& batch) {
  RETURN_IF_ERROR(check_header(batch));
  for (size_t i = 0; i < batch.inserts.size(); ++i)
    RETURN_IF_ERROR(check_insert(batch.inserts[i], absl::StrCat("inserts[", i, "]")));
  for (size_t i = 0; i < batch.moves.size(); ++i)
    RETURN_IF_ERROR(check_move(batch.moves[i], absl::StrCat("moves[", i, "]")));
  for (size_t i = 0; i < batch.relabels.size(); ++i)
    RETURN_IF_ERROR(check_labels(batch.relabels[i], batch.relabels[i].ids.size(), absl::StrCat("relabels[", i, "]")));
  return absl::OkStatus();
}

}  // namespace locus
