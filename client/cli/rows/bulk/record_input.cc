#include "client/cli/rows/bulk/record_input.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr size_t kChunkBytes = 65536;
constexpr absl::string_view kByteOrderMark = "\xEF\xBB\xBF";

}  // namespace

absl::StatusOr<Arrival> RecordInput::next(Record& record, std::optional<Clock::time_point> pause_at) {
  line_ = next_line_;
  while (!find_end()) {
    if (scanned_ - begin_ > kMaxRecordBytes) {
      return absl::InvalidArgumentError(
          in_quotes_ ? absl::StrCat("a quote is opened and not closed within ", kMaxRecordBytes, " bytes")
                     : absl::StrCat("the line is longer than ", kMaxRecordBytes, " bytes"));
    }
    if (!ended_ && pause_at) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(*pause_at - Clock::now());
      if (!input_.ready_within(std::max(left, std::chrono::milliseconds(0)))) return Arrival::kPause;
    }
    RETURN_IF_ERROR(read_more().status());
    if (!ended_) continue;
    if (in_quotes_) return absl::InvalidArgumentError("a quote is opened and not closed");
    if (begin_ == buffer_.size()) return Arrival::kEnd;
    hand_out(buffer_.size(), record);
    return Arrival::kRecord;
  }
  if (scanned_ - begin_ > kMaxRecordBytes + 2) {
    return absl::InvalidArgumentError(absl::StrCat("the line is longer than ", kMaxRecordBytes, " bytes"));
  }
  hand_out(scanned_, record);
  return Arrival::kRecord;
}

// Scans for the end of a record. Returns true if [begin_, scanned_) is a complete record including its line end. A line
// break is inside a quoted field if the number of quotes before it is odd; this holds because a quote within a quoted
// field is written twice.
bool RecordInput::find_end() {
  while (scanned_ < buffer_.size()) {
    const char c = buffer_[scanned_++];
    if (c == '"' && form_ == RecordForm::kCsv) in_quotes_ = !in_quotes_;
    if (c != '\n') continue;
    ++next_line_;
    if (!in_quotes_) return true;
  }
  return false;
}

absl::StatusOr<bool> RecordInput::read_more() {
  buffer_.erase(0, begin_);
  scanned_ -= begin_;
  begin_ = 0;
  const size_t had = buffer_.size();
  buffer_.resize(had + kChunkBytes);
  const absl::StatusOr<size_t> count = input_.read(absl::MakeSpan(buffer_).subspan(had));
  buffer_.resize(had + (count.ok() ? *count : 0));
  RETURN_IF_ERROR(count.status());
  ended_ = *count == 0;
  return !ended_;
}

void RecordInput::hand_out(size_t end, Record& record) {
  absl::string_view text = absl::string_view(buffer_).substr(begin_, end - begin_);
  if (absl::ConsumeSuffix(&text, "\n")) absl::ConsumeSuffix(&text, "\r");
  if (line_ == 1) absl::ConsumePrefix(&text, kByteOrderMark);
  record = {text, line_};
  begin_ = scanned_ = end;
}

}  // namespace locus::cli
