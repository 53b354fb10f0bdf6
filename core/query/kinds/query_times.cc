#include "core/query/kinds/query_times.h"

#include "absl/strings/str_cat.h"
#include "core/base/column.h"
#include "core/base/refusal.h"

namespace locus {
namespace {

absl::Status not_kept(const SceneSnapshot& snapshot, const AsOf& time, const std::string& field, size_t entry) {
  Refusal refusal;
  refusal.reason = Reason::kOutOfRange;
  refusal.field = field + ".as_of_ticks";
  refusal.index = static_cast<uint32_t>(entry);
  refusal.asked = static_cast<double>(time.tick) + double{time.fraction};
  const std::string fraction = time.fraction == 0 ? "" : absl::StrCat(" and a fraction of ", time.fraction);
  return refuse(
      absl::StatusCode::kOutOfRange,
      absl::StrCat("tick ", time.tick, fraction, " is not kept; ticks ", snapshot.oldest_tick(), " to ", snapshot.tick,
                   " are. Ask about one of those, clamp, or create the scene with a longer ", "history_ticks"),
      refusal);
}

}  // namespace

absl::StatusOr<QueryTimes> QueryTimes::resolve(const SceneSnapshot& snapshot, const QueryBlock& block,
                                               const std::string& field) {
  QueryTimes result;
  const size_t n = query_count(block);
  if (block.as_of_ticks.empty() || n == 0) {
    result.moments_.emplace_back(snapshot.objects);
    return result;
  }
  const ColumnReader<uint64_t> ticks(block.as_of_ticks, 1);
  const ColumnReader<float> fractions(block.as_of_fractions, 1);
  const size_t entries = block.as_of_ticks.size() == 1 && block.as_of_fractions.size() <= 1 ? 1 : n;
  for (size_t i = 0; i < entries; ++i) {
    const AsOf asked{ticks.value(i, 0), fractions.value(i, 0)};
    const AsOf time = nearest_kept(snapshot, asked);
    if (!(time == asked) && block.outside == OutsideHistory::kReject) return not_kept(snapshot, asked, field, i);
    const bool repeated = i > 0 && time == result.times_.back();
    result.moments_.push_back(repeated ? result.moments_.back() : *find_scene_at(snapshot, time));
    result.times_.push_back(time);
    result.clamped_.push_back(time == asked ? 0 : 1);
  }
  return result;
}

}  // namespace locus
