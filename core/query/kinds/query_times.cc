#include "core/query/kinds/query_times.h"

#include <optional>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "core/base/column.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"

namespace locus {
namespace {

// Returns the part of the error message that explains why the history begins at its oldest tick and that advises the
// caller what to do.
std::string explanation(const SceneSnapshot& snapshot) {
  switch (snapshot.past_limit) {
    case PastLimit::kOff:
      return "the scene has no history. Query the current tick, clamp, or create the scene with history_ticks";
    case PastLimit::kBegan:
      return "the scene's ticks began there. Query one of these ticks, or clamp";
    case PastLimit::kTicks:
      return "older ticks are beyond history_ticks. Query one of these ticks, clamp, or create the scene with a larger "
             "history_ticks";
    case PastLimit::kBytes:
      return "older ticks did not fit into history_bytes. Query one of these ticks, clamp, or create the scene with a "
             "larger history_bytes";
    case PastLimit::kMemory:
      return "older ticks were dropped because the server was short of memory. Query one of these ticks, clamp, or "
             "give the server a larger --memory-limit";
    case PastLimit::kRestored:
      return "the server has restarted, and the disk has no history from before the scene's last snapshot. Query "
             "one of these ticks, or clamp";
  }
  return "";
}

// Returns the error for `time`, which is outside the history. `field` is the name of the block in the error, and
// `entry` is the index of the time in the block's as_of columns.
absl::Status not_kept(const SceneSnapshot& snapshot, const AsOf& time, const std::string& field, size_t entry) {
  Refusal refusal;
  refusal.reason = Reason::kOutOfRange;
  refusal.field = field + ".as_of_ticks";
  refusal.index = static_cast<uint32_t>(entry);
  refusal.asked = static_cast<double>(time.tick) + double{time.fraction};
  const std::string fraction = time.fraction == 0 ? "" : absl::StrCat(" and a fraction of ", time.fraction);
  const std::string asked = absl::StrCat("tick ", time.tick, fraction);
  const std::string kept = absl::StrCat("the recorded ticks are ", snapshot.oldest_tick(), " to ", snapshot.tick);
  const std::string message =
      time.tick < snapshot.oldest_tick()
          ? absl::StrCat(asked, " is too old; ", kept, ": ", explanation(snapshot))
          : absl::StrCat(asked, " is in the future; ", kept, ". Query one of these ticks, or clamp");
  return refuse(absl::StatusCode::kOutOfRange, message, refusal);
}

absl::Status too_many_times(const std::string& field, size_t entry) {
  Refusal refusal;
  refusal.reason = Reason::kLimit;
  refusal.field = field + ".as_of_ticks";
  refusal.index = static_cast<uint32_t>(entry);
  refusal.limit = "interpolated_bytes";
  refusal.limit_value = limits::kMaxInterpolatedBytes;
  return refuse(absl::StatusCode::kInvalidArgument,
                "too many different times between ticks at which instances moved. Ask for fewer times in one batch, or "
                "for whole ticks",
                refusal);
}

}  // namespace

absl::StatusOr<QueryTimes> QueryTimes::resolve(const SceneSnapshot& snapshot, const QueryBlock& block,
                                               const std::string& field, InterpolationBudget& budget) {
  QueryTimes result;
  absl::flat_hash_map<std::pair<uint64_t, float>, size_t>
      moving;  // index in scenes_ of each time with moving instances
  const size_t n = query_count(block);
  if (block.as_of_ticks.empty() || n == 0) {
    result.scenes_.emplace_back(snapshot.objects, *snapshot.statics);
    LOCUS_DCHECK_CALL(result.check_invariants(n));
    return result;
  }
  const ColumnReader<uint64_t> ticks(block.as_of_ticks, 1);
  const ColumnReader<float> fractions(block.as_of_fractions, 1);
  const size_t entries = block.as_of_ticks.size() == 1 && block.as_of_fractions.size() <= 1 ? 1 : n;
  for (size_t i = 0; i < entries; ++i) {
    const AsOf asked{ticks.value(i, 0), fractions.value(i, 0)};
    LOCUS_DCHECK(asked.fraction >= 0 && asked.fraction < 1);
    const AsOf time = nearest_kept(snapshot, asked);
    if (!(time == asked) && block.outside == OutsideHistory::kReject) return not_kept(snapshot, asked, field, i);
    const bool repeated = i > 0 && time == result.times_.back();
    const auto known = moving.empty() ? moving.end() : moving.find({time.tick, time.fraction});
    if (repeated || known != moving.end()) {
      result.scenes_.push_back(result.scenes_[repeated ? i - 1 : known->second]);
    } else {
      result.scenes_.push_back(*find_scene_at(snapshot, time));
      const std::optional<uint64_t> bytes = result.scenes_.back().take_interpolated_bytes(budget);
      if (!bytes) return too_many_times(field, i);
      if (*bytes != 0) moving.emplace(std::pair(time.tick, time.fraction), i);
    }
    result.times_.push_back(time);
    result.clamped_.push_back(time == asked ? 0 : 1);
  }
  LOCUS_DCHECK_CALL(result.check_invariants(n));
  return result;
}

}  // namespace locus
