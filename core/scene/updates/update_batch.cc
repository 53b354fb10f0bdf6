#include "core/scene/updates/update_batch.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
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
    RETURN_IF_ERROR(check_labels(insert));
    return check_length(insert.expire_ticks.size(), 1, ColumnNeed::kOptional, "expire_ticks");
  }

  absl::Status run(const MoveColumns& move) const {
    RETURN_IF_ERROR(check_positions(move.positions, move.positions_f64));
    RETURN_IF_ERROR(check_length(move.rotations.size(), 4, ColumnNeed::kOptional, "rotations"));
    return check_new_poses(move);
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

  absl::Status malformed(absl::string_view column, absl::string_view message) const {
    return refuse_argument(Reason::kMalformed, ColumnName{list_, index_, column}.text(), {}, message);
  }

  absl::Status check_new_poses(const MoveColumns& move) const {
    const bool given = !move.part_positions.empty() || !move.part_rotations.empty();
    if (given && move.parts_each == 0)
      return malformed("parts_each", "give the number of parts of each object with part_positions or part_rotations");
    if (move.parts_each > limits::kMaxParts)
      return refuse_limit(ColumnName{list_, index_, "parts_each"}.text(), "parts", limits::kMaxParts, move.parts_each);
    if (move.parts_each == 0) return absl::OkStatus();
    if (!given && items_ != 0) return malformed("parts_each", "give part_positions or part_rotations, too");
    const size_t parts = move.parts_each;
    RETURN_IF_ERROR(check_length(move.part_positions.size(), 3 * parts, ColumnNeed::kOptional, "part_positions"));
    return check_length(move.part_rotations.size(), 4 * parts, ColumnNeed::kOptional, "part_rotations");
  }

  absl::Status check_compound(const InsertColumns& insert) const {
    const std::string list = ColumnName{list_, index_, "compound.parts"}.text();
    for (size_t i = 0; i < insert.parts.size(); ++i) {
      const PartColumns& parts = insert.parts[i];
      const ElementCheck check(list, i, parts.count());
      const bool whole = parts.count() != 0 && parts.positions.size() % 3 == 0;
      if (!whole)
        return refuse_argument(Reason::kColumnLength, ColumnName{list, i, "positions"}.text(), {},
                               absl::StrCat("holds ", parts.positions.size(), " numbers; give three for each part"));
      RETURN_IF_ERROR(check.check_length(parts.rotations.size(), 4, ColumnNeed::kOptional, "rotations"));
      RETURN_IF_ERROR(check.check_size(parts));
      RETURN_IF_ERROR(check.check_length(parts.layers.size(), 1, ColumnNeed::kOptional, "layers"));
    }
    const size_t parts = part_count(insert);
    if (parts == 0) return refuse_argument(Reason::kMalformed, list, {}, "a compound needs at least one part");
    if (parts > limits::kMaxParts) return refuse_limit(list, "parts", limits::kMaxParts, static_cast<double>(parts));
    return absl::OkStatus();
  }

  absl::Status check_shape(const InsertColumns& insert) const {
    if (insert.kind == ShapeKind::kCompound) return check_compound(insert);
    LOCUS_DCHECK(insert.parts.empty());
    return insert.kind == ShapeKind::kPoint ? absl::OkStatus() : check_size(insert);
  }

  // Checks the columns of radii and extents that the kind of the shapes needs.
  template <class Columns>
  absl::Status check_size(const Columns& insert) const {
    switch (insert.kind) {
      case ShapeKind::kPoint:
      case ShapeKind::kCompound:
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

absl::Status check_header(const UpdateBatch& batch) {
  if (!is_finite(batch.frame)) return refuse_argument(Reason::kNotFinite, "frame", {}, "a frame needs finite numbers");
  if (max_component(abs(batch.frame)) > limits::kMaxCoordinate)
    return refuse_argument(Reason::kOutOfRange, "frame", {}, "frames must lie within +-1e9");
  if ((batch.writer == 0) != (batch.batch == 0))
    return refuse_argument(Reason::kMalformed, batch.writer == 0 ? "writer" : "batch", {},
                           "writer and batch go together: a random number that is not 0, and 1, 2, 3, ...");
  if (batch.lease_ms != 0 && batch.writer == 0)
    return refuse_argument(Reason::kMalformed, "lease_ms", {}, "a lease belongs to a writer: give writer and batch");
  if (batch.lease_ms > limits::kMaxLeaseMs)
    return refuse_limit("lease_ms", "lease_ms", limits::kMaxLeaseMs, batch.lease_ms);
  const uint64_t items = count_items(batch);
  if (items > limits::kMaxUpdateItems)
    return refuse_limit("batch", "update_items", limits::kMaxUpdateItems, static_cast<double>(items));
  if (batch.earlier.size() >= limits::kMaxUpdateMessages)
    return refuse_limit("continues", "update_messages", limits::kMaxUpdateMessages,
                        static_cast<double>(batch.earlier.size()) + 1);
  return absl::OkStatus();
}

absl::Status check_lists(const UpdateBatch& batch) {
  RETURN_IF_ERROR(check_list("inserts", batch.inserts));
  RETURN_IF_ERROR(check_list("moves", batch.moves));
  RETURN_IF_ERROR(check_list("relabels", batch.relabels));
  RETURN_IF_ERROR(check_list("instance_moves", batch.instance_moves));
  return check_list("instance_relabels", batch.instance_relabels);
}

bool only_moves(const UpdateBatch& batch) {
  if (batch.clear || batch.restart_ticks || batch.all_or_nothing || batch.moves.empty()) return false;
  if (batch.lease_ms != 0 || batch.end_lease != 0 || !batch.earlier.empty()) return false;
  if (!batch.remove_ids.empty() || !batch.remove_groups.empty() || !batch.inserts.empty() || !batch.relabels.empty())
    return false;
  if (has_instances(batch)) return false;
  return std::none_of(batch.moves.begin(), batch.moves.end(),
                      [](const MoveColumns& move) { return move.teleport || move.parts_each != 0; });
}

}  // namespace

size_t part_count(const InsertColumns& insert) {
  size_t parts = 0;
  for (const PartColumns& columns : insert.parts) parts += columns.count();
  return parts;
}

bool may_join(const UpdateBatch& first, const UpdateBatch& second) {
  return first.tick == second.tick && only_moves(first) && only_moves(second);
}

bool has_instances(const UpdateBatch& batch) {
  return !batch.instance_moves.empty() || !batch.instance_relabels.empty() ||
         std::any_of(batch.earlier.begin(), batch.earlier.end(), has_instances);
}

uint64_t count_items(const UpdateBatch& batch) {
  uint64_t items = batch.remove_ids.size() + batch.remove_groups.size();
  for (const InsertColumns& insert : batch.inserts) items += insert.ids.size() + part_count(insert);
  for (const MoveColumns& move : batch.moves) items += move.ids.size() + part_count(move);
  for (const RelabelColumns& relabel : batch.relabels) items += relabel.ids.size();
  for (const InstanceMoveColumns& move : batch.instance_moves) items += move.ids.size();
  for (const RelabelColumns& relabel : batch.instance_relabels) items += relabel.ids.size();
  for (const UpdateBatch& message : batch.earlier) items += count_items(message);
  return items;
}

uint64_t count_lists(const UpdateBatch& batch) {
  uint64_t lists = batch.inserts.size() + batch.moves.size() + batch.relabels.size() + batch.instance_moves.size() +
                   batch.instance_relabels.size();
  for (const InsertColumns& insert : batch.inserts) lists += insert.parts.size();
  for (const MoveColumns& move : batch.moves) lists += move.parts_each == 0 ? 0 : 1;
  for (const UpdateBatch& message : batch.earlier) lists += count_lists(message);
  return lists;
}

absl::Status check_form(const UpdateBatch& batch) {
  RETURN_IF_ERROR(check_header(batch));
  RETURN_IF_ERROR(check_lists(batch));
  for (const UpdateBatch& message : batch.earlier) {
    RETURN_IF_ERROR(check_earlier(message));
    RETURN_IF_ERROR(check_header(message));
    RETURN_IF_ERROR(check_lists(message));
  }
  if (batch.earlier.empty()) return absl::OkStatus();
  if (const uint64_t lists = count_lists(batch); lists > limits::kMaxUpdateLists)
    return refuse_limit("batch", "update_lists", limits::kMaxUpdateLists, static_cast<double>(lists));
  return absl::OkStatus();
}

absl::Status check_earlier(const UpdateBatch& batch) {
  LOCUS_DCHECK(batch.earlier.empty());  // the messages of a revision are one list
  const char* const field = batch.tick             ? "tick"
                            : batch.restart_ticks  ? "restart_ticks"
                            : batch.writer != 0    ? "writer"
                            : batch.batch != 0     ? "batch"
                            : batch.all_or_nothing ? "all_or_nothing"
                            : batch.lease_ms != 0  ? "lease_ms"
                            : batch.end_lease != 0 ? "end_lease"
                                                   : nullptr;
  if (field == nullptr) return absl::OkStatus();
  return refuse_argument(Reason::kMalformed, field, {}, "only the last message of a revision may have this field");
}

}  // namespace locus
