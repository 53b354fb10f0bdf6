#include "core/scene/updates/writer_table.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/refusal.h"

namespace locus {
namespace {

absl::Status gap(uint64_t expected, uint64_t batch) {
  Refusal refusal;
  refusal.reason = Reason::kBatchGap;
  refusal.field = "batch";
  refusal.limit_value = static_cast<double>(expected);
  refusal.asked = static_cast<double>(batch);
  return refuse(absl::StatusCode::kFailedPrecondition,
                absl::StrCat("the next batch of this writer is ", expected, ", not ", batch,
                             expected == 1 ? "; unknown writers start at 1" : "; send what is missing first"),
                refusal);
}

}  // namespace

void WriterTable::check_invariants() const {
  LOCUS_CHECK_LE(writers_.size(), size_t{limits::kMaxWriters});
  LOCUS_CHECK_LE(kept_errors_, kMaxKeptErrors);
  LOCUS_CHECK(!writers_.empty() || kept_errors_ == 0);
  LOCUS_CHECK(!writers_.contains(0));
}

absl::StatusOr<std::optional<UpdateAck>> WriterTable::admit(uint64_t writer, uint64_t batch) const {
  LOCUS_DCHECK(writer == 0 || batch != 0);  // check_form() has checked this
  if (writer == 0) return std::optional<UpdateAck>();
  const auto known = writers_.find(writer);
  const uint64_t last = known == writers_.end() ? 0 : known->second.batch;
  if (batch == last + 1) return std::optional<UpdateAck>();
  if (batch > last) return gap(last + 1, batch);
  UpdateAck ack;
  if (batch == last) ack = known->second.ack;
  ack.duplicate = true;
  return std::optional<UpdateAck>(std::move(ack));
}

void WriterTable::record(uint64_t writer, uint64_t batch, const UpdateAck& ack) {
  if (writer == 0) return;
  LOCUS_DCHECK_NE(batch, uint64_t{0});
  LOCUS_DCHECK_LE(ack.errors.size(), size_t{limits::kMaxListedItemErrors});
  if (writers_.size() >= limits::kMaxWriters && !writers_.contains(writer)) forget_oldest();
  Last& last = writers_[writer];
  LOCUS_DCHECK_GE(kept_errors_, last.ack.errors.size());
  kept_errors_ -= last.ack.errors.size();
  if (kept_errors_ + ack.errors.size() > kMaxKeptErrors) forget_acks();
  kept_errors_ += ack.errors.size();
  last = {batch, ++clock_, ack};
  LOCUS_DCHECK_CALL(check_invariants());
}

void WriterTable::forget_oldest() {
  LOCUS_DCHECK(!writers_.empty());
  const auto oldest = std::min_element(writers_.begin(), writers_.end(),
                                       [](const auto& a, const auto& b) { return a.second.heard < b.second.heard; });
  kept_errors_ -= oldest->second.ack.errors.size();
  writers_.erase(oldest);
}

// Drops the acks but keeps the batch numbers, so that no batch is applied twice.
void WriterTable::forget_acks() {
  for (auto& [writer, last] : writers_) last.ack = {};
  kept_errors_ = 0;
}

std::vector<WriterTable::Writer> WriterTable::writers() const {
  std::vector<Writer> writers;
  writers.reserve(writers_.size());
  for (const auto& [number, last] : writers_) writers.push_back({number, last.batch, last.heard, last.ack});
  std::sort(writers.begin(), writers.end(), [](const Writer& a, const Writer& b) { return a.number < b.number; });
  return writers;
}

bool WriterTable::restore(Writer writer) {
  if (writers_.size() >= limits::kMaxWriters || kept_errors_ + writer.ack.errors.size() > kMaxKeptErrors) return false;
  if (writer.number == 0 || writer.batch == 0 || writers_.contains(writer.number)) return false;
  kept_errors_ += writer.ack.errors.size();
  clock_ = std::max(clock_, writer.heard);
  writers_[writer.number] = {writer.batch, writer.heard, std::move(writer.ack)};
  LOCUS_DCHECK_CALL(check_invariants());
  return true;
}

}  // namespace locus
