#include "core/scene/updates/move_applier.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"

namespace locus {
namespace {

// Number of items that are read together. Before the first of them is read, the handles of all these items are looked
// up and the memory to which the handles refer is prefetched.
constexpr size_t kItemsAtOnce = 64;
// Number of items whose handles are remembered: their ids take kKeptScratch bytes.
constexpr size_t kRememberedItems = kKeptScratch / sizeof(Id);

}  // namespace

void MoveApplier::check_invariants() const {
  for (size_t i = 0; i < moves_.size(); ++i) {
    LOCUS_CHECK_EQ(size_t{last_move_[moves_[i].handle]}, i);
    LOCUS_CHECK(moves_[i].rotation == GridMove::kKeeps || moves_[i].rotation < rotations_.size());
  }
  LOCUS_CHECK_LE(errors_.size(), size_t{refused_});
}

bool MoveApplier::serves(const UpdateBatch& batch) {
  return !batch.clear && !batch.restart_ticks && batch.remove_ids.empty() && batch.remove_groups.empty() &&
         batch.inserts.empty() && batch.relabels.empty() && !batch.moves.empty() && batch.earlier.empty() &&
         std::none_of(batch.moves.begin(), batch.moves.end(),
                      [](const MoveColumns& move) { return move.parts_each != 0; });
}

void MoveApplier::begin(const ObjectStore& objects) {
  moves_.clear();
  rotations_.clear();
  last_move_.resize(std::max(last_move_.size(), objects.handle_count()));
  items_read_ = 0;
}

void MoveApplier::add(const ObjectStore& objects, const UpdateBatch& batch) {
  LOCUS_DCHECK(serves(batch) && check_form(batch).ok());
  LOCUS_DCHECK_GE(last_move_.size(), objects.handle_count());  // begin() was called for this store
  applied_ = refused_ = 0;
  errors_.clear();
  if (lives_ended_ != objects.ended_lives()) {
    remembered_ids_.clear();
    remembered_handles_.clear();
    lives_ended_ = objects.ended_lives();
  }
  for (size_t list = 0; list < batch.moves.size(); ++list) run(objects, batch.frame, batch.moves[list], list);
}

void MoveApplier::finish(const ObjectStore& objects) {
  changes_ = std::any_of(moves_.begin(), moves_.end(), [&](const GridMove& move) {
    const GridRef now = objects.at(move.handle);
    return !(move.position == now.entry().position) ||
           (move.rotation != GridMove::kKeeps && !(rotations_[move.rotation] == now.form().rotation));
  });
  LOCUS_DCHECK_CALL(check_invariants());
}

void MoveApplier::refuse(const char* column, const Item& item, Reason reason) {
  ++refused_;
  if (errors_.size() < limits::kMaxListedItemErrors)
    errors_.push_back({absl::StrCat("moves[", item.list, "].", column), item.index, item.id, reason});
}

// Moves the object of `handle` to `position`. Returns the index of its move.
inline uint32_t MoveApplier::add_move(uint32_t handle, Vec3d position) {
  const uint32_t last = last_move_[handle];
  if (last < moves_.size() && moves_[last].handle == handle) {
    moves_[last].position = position;
    return last;
  }
  const auto index = static_cast<uint32_t>(moves_.size());
  last_move_[handle] = index;
  moves_.push_back({position, handle});
  return index;
}

// Reads one item, with its rotation if the columns have rotations.
void MoveApplier::move(const PoseReader& poses, uint32_t handle, const Item& item) {
  if (handle == ObjectStore::kNoHandle) return refuse("ids", item, Reason::kUnknownId);
  Vec3d position;
  Quaternion rotation;
  if (const Reason reason = poses.read_position(item.index, position); reason != Reason::kUnspecified)
    return refuse(poses.position_column(), item, reason);
  if (poses.has_rotations()) {
    if (const Reason reason = poses.read_rotation(item.index, rotation); reason != Reason::kUnspecified)
      return refuse(PoseReader::kRotationColumn, item, reason);
  }
  const uint32_t index = add_move(handle, position);
  if (!poses.has_rotations()) return;
  moves_[index].rotation = static_cast<uint32_t>(rotations_.size());
  rotations_.push_back(rotation);
}

absl::Span<const uint32_t> MoveApplier::handles_of(const ObjectStore& objects, absl::Span<const Id> ids) {
  const size_t first = std::exchange(items_read_, items_read_ + ids.size());
  if (first + ids.size() <= remembered_ids_.size() &&
      std::equal(ids.begin(), ids.end(), remembered_ids_.begin() + static_cast<ptrdiff_t>(first)))
    return absl::MakeConstSpan(remembered_handles_).subspan(first, ids.size());
  handles_.resize(ids.size());
  objects.find_handles(ids, absl::MakeSpan(handles_));
  const bool all_known = std::find(handles_.begin(), handles_.end(), ObjectStore::kNoHandle) == handles_.end();
  if (!all_known || first > remembered_ids_.size() || first + ids.size() > kRememberedItems) return handles_;
  const size_t size = std::max(remembered_ids_.size(), first + ids.size());
  remembered_ids_.resize(size);
  remembered_handles_.resize(size);
  std::copy(ids.begin(), ids.end(), remembered_ids_.begin() + static_cast<ptrdiff_t>(first));
  std::copy(handles_.begin(), handles_.end(), remembered_handles_.begin() + static_cast<ptrdiff_t>(first));
  return handles_;
}

void MoveApplier::run(const ObjectStore& objects, Vec3d frame, const MoveColumns& columns, size_t list) {
  const PoseReader poses(frame, columns.positions, columns.positions_f64, columns.rotations);
  const bool has_rotations = poses.has_rotations();
  const bool few = columns.ids.size() < objects.size() / 2;  // else the grid visits bricks instead of objects
  const uint32_t refused_before = refused_;
  moves_.reserve(moves_.size() + columns.ids.size());
  for (size_t begin = 0; begin < columns.ids.size(); begin += kItemsAtOnce) {
    const absl::Span<const uint64_t> ids = columns.ids.subspan(begin, kItemsAtOnce);
    const absl::Span<const uint32_t> handles = handles_of(objects, ids);
    for (const uint32_t handle : handles) {
      if (handle == ObjectStore::kNoHandle) continue;
      if (few) objects.prefetch_slot(handle);
      __builtin_prefetch(&last_move_[handle]);
    }
    for (size_t i = 0; i < ids.size(); ++i) {
      Vec3d position;
      // The common case is read here, without the call and without the fields of an item that may be refused.
      if (!has_rotations && handles[i] != ObjectStore::kNoHandle &&
          poses.read_position(begin + i, position) == Reason::kUnspecified) {
        add_move(handles[i], position);
      } else {
        move(poses, handles[i], {list, static_cast<uint32_t>(begin + i), ids[i]});
      }
    }
  }
  applied_ += static_cast<uint32_t>(columns.ids.size()) - (refused_ - refused_before);
}

}  // namespace locus
