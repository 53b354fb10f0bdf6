#include "client/cli/commands/bulk_update.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <future>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "client/cli/failure.h"
#include "client/cli/progress.h"
#include "client/cli/report_stream.h"
#include "client/cli/rows/update_report.h"
#include "client/lib/status.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

std::vector<size_t> list_starts_of(const v1::UpdateBatch& batch) {
  std::vector<size_t> starts;
  size_t rows = 0;
  const auto add = [&](int size) {
    starts.push_back(rows);
    rows += static_cast<size_t>(size);
  };
  if (batch.remove_ids_size() > 0) add(batch.remove_ids_size());
  for (const v1::Insert& insert : batch.inserts()) add(insert.ids_size());
  for (const v1::Move& move : batch.moves()) add(move.ids_size());
  return starts;
}

// Rows of the messages that are answered by one ack.
struct AnsweredRows {
  std::vector<SentRows> messages;

  size_t rows() const {
    size_t rows = 0;
    for (const SentRows& message : messages) rows += message.rows();
    return rows;
  }
  // Returns the rows of the message of a refused item.
  const SentRows& message_of(const v1::ItemError& item) const {
    return messages[std::min<size_t>(item.message(), messages.size() - 1)];
  }
  // Returns the rows for an error that names no message: of several messages, all lines without their lists.
  SentRows whole() const {
    if (messages.size() == 1) return messages.front();
    SentRows all;
    for (const SentRows& message : messages)
      all.lines.insert(all.lines.end(), message.lines.begin(), message.lines.end());
    return all;
  }
};

class BulkUpdateRun {
 public:
  BulkUpdateRun(const BulkUpdate& update, const std::string& scene, const BulkOptions& bulk, Context& context)
      : update_(update), scene_(scene), bulk_(bulk), context_(context), progress_(start_progress(context)) {}

  absl::Status run() {
    // While a script is only checked, do not open the input: an earlier line of the script may create the file, and a
    // pipe can be read only once.
    if (context_.lines() == Lines::kScriptCheck) return absl::OkStatus();
    ASSIGN_OR_RETURN(const std::unique_ptr<RowReader> reader, open_rows(bulk_, update_.schema));
    ASSIGN_OR_RETURN(client::Client* const client, context_.connect());
    reader_ = reader.get();
    client::UpdateStreamOptions options;
    options.max_in_flight = static_cast<int>(kBulkWindow);
    if (bulk_.lease_seconds) options.lease = absl::Seconds(*bulk_.lease_seconds);
    stream_ = client->update_stream(scene_, options);
    progress_.begin({.action = "sending", .subject = reader_->name(), .unit = "rows"});
    absl::Status status = send_all();
    // Even after an error, wait for the acks of all batches in flight, since the report counts their items.
    while (!timed_out_ && !in_flight_.empty()) status.Update(take_front());
    write_totals();
    if (!status.ok()) return in_words(status, absl::StrCat(status.message(), "; ", what_was_done()));
    status = stream_->close();
    return status.ok() ? refusal() : status;
  }

 private:
  struct InFlight {
    AnsweredRows sent;
    std::future<absl::StatusOr<v1::UpdateAck>> ack;
  };

  absl::Status send_all() {
    RowBatch batch;
    while (true) {
      const Patience patience = in_flight_.empty() ? Patience::kWait : Patience::kPause;
      ASSIGN_OR_RETURN(const BatchEnd end, reader_->next(bulk_.batch.value_or(kDefaultBulkBatch), patience, batch));
      // If the input has no rows, send one empty batch: the server checks that the scene exists, and returns its
      // revision.
      if (batch.rows() > 0 || (end == BatchEnd::kEnd && batches_ == 0 && in_flight_.empty() && held_.empty())) {
        RETURN_IF_ERROR(bulk_.one_revision ? hold(batch) : send(batch));
      }
      if (end == BatchEnd::kEnd && bulk_.one_revision) send_held();
      while (!in_flight_.empty() && (end != BatchEnd::kFull || is_there(in_flight_.front()))) {
        RETURN_IF_ERROR(take_front());
      }
      if (end == BatchEnd::kEnd) return absl::OkStatus();
    }
  }

  absl::Status check_rows(const RowBatch& batch) const {
    for (size_t row = 0; update_.check_row && row < batch.rows(); ++row) {
      const absl::Status checked = update_.check_row(batch, row);
      if (!checked.ok()) {
        return in_words(checked, absl::StrCat(reader_->name(), ":", batch.lines[row], ": ", checked.message()));
      }
    }
    return absl::OkStatus();
  }

  absl::Status send(const RowBatch& batch) {
    RETURN_IF_ERROR(check_rows(batch));
    while (in_flight_.size() >= kBulkWindow) {
      RETURN_IF_ERROR(take_front());
    }
    v1::UpdateBatch message = update_.batch_of(batch);
    InFlight& next = in_flight_.emplace_back();
    LOCUS_CHECK_LE(in_flight_.size(), kBulkWindow);
    next.sent.messages = {sent_rows(batch, message)};
    next.ack = stream_->send(std::move(message));
    return absl::OkStatus();
  }

  // Keeps the batch until send_held() sends all batches as one revision.
  absl::Status hold(const RowBatch& batch) {
    RETURN_IF_ERROR(check_rows(batch));
    if (batch.first_row + batch.rows() > limits::kMaxUpdateItems) {
      return absl::InvalidArgumentError(
          absl::StrCat(reader_->name(), ": has more than ", limits::kMaxUpdateItems,
                       " rows, the most that one revision can have; leave --one-revision out or divide the input"));
    }
    v1::UpdateBatch& message = held_.emplace_back(update_.batch_of(batch));
    held_rows_.messages.push_back(sent_rows(batch, message));
    return absl::OkStatus();
  }

  // Sends the held batches together. Only the last of them may have the tick.
  void send_held() {
    for (size_t i = 0; i + 1 < held_.size(); ++i) held_[i].clear_tick();
    InFlight& next = in_flight_.emplace_back();
    next.sent = std::move(held_rows_);
    next.ack = stream_->send_together(std::move(held_));
  }

  static SentRows sent_rows(const RowBatch& batch, const v1::UpdateBatch& message) {
    return {.first_row = batch.first_row, .lines = batch.lines, .list_starts = list_starts_of(message)};
  }

  std::string what_was_done() const {
    std::string known = batches_ == 0 && unknown_ == 0 ? "nothing was applied" : "";
    if (batches_ > 0) known = absl::StrCat("of the rows sent ", applied_, " were applied and ", refused_, " refused");
    if (unknown_ == 0) return known;
    return absl::StrCat(known, known.empty() ? "" : "; ", "whether ", unknown_, batches_ > 0 ? " other" : "",
                        " rows were applied is not known");
  }

  static bool is_there(const InFlight& message) {
    return message.ack.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }

  absl::Status take_front() {
    InFlight front = std::move(in_flight_.front());
    in_flight_.pop_front();
    const double seconds = context_.options().timeout_seconds.value_or(kBulkAnswerSeconds);
    if (front.ack.wait_for(std::chrono::duration<double>(seconds)) != std::future_status::ready) {
      timed_out_ = true;
      unknown_ += front.sent.rows();
      for (const InFlight& message : in_flight_) unknown_ += message.sent.rows();
      return absl::DeadlineExceededError(
          absl::StrCat(reader_->name(), ":", front.sent.whole().line_range(), ": no answer within ", seconds, " s"));
    }
    const absl::StatusOr<v1::UpdateAck> ack = front.ack.get();
    if (!ack.ok()) {
      if (!client::refused_by_server(ack.status())) unknown_ += front.sent.rows();
      return refused_rows(ack.status(), reader_->name(), front.sent.whole());
    }
    count(*ack);
    if (ack->errors_size() > 0) {
      progress_.hide();
      for (const v1::ItemError& item : ack->errors()) write_refused(item, front.sent.message_of(item));
      context_.out().flush();
      progress_.show();
    }
    progress_.update_share(applied_ + refused_, reader_->share_read());
    return context_.out() ? absl::OkStatus() : absl::UnknownError("cannot write the output");
  }

  void count(const v1::UpdateAck& ack) {
    context_.remember_own(scene_, {ack.epoch(), ack.revision()});
    ++batches_;
    applied_ += ack.applied();
    refused_ += ack.refused();
    last_ = ack;
    last_.clear_errors();
  }

  void write_refused(const v1::ItemError& item, const SentRows& sent) {
    const std::optional<uint64_t> line = sent.line_of(item.field(), item.index());
    const std::string reason(absl::StripPrefix(v1::Reason_Name(item.reason()), "REASON_"));
    if (!errors_) {
      errors_.emplace(context_.out(), context_.options().format,
                      ReportShape{.rows_name = "errors", .keys = {"line", "id", "reason"}, .width_rows = 1000});
      errors_->begin(Json::object());
      first_refused_ =
          absl::StrCat(reader_->name(), line ? absl::StrCat(":", *line) : "", ", id ", item.id(), ": ", reason);
    }
    all_unknown_ &= item.reason() == v1::REASON_UNKNOWN_ID;
    errors_->add({{"line", line ? Json(*line) : Json()}, {"id", id_json(item.id())}, {"reason", reason}});
  }

  void write_totals() {
    progress_.hide();
    if (batches_ == 0) return;
    Report report;
    report.head = {{"applied", applied_},          {"refused", refused_},  {"batches", batches_},
                   {"revision", last_.revision()}, {"tick", last_.tick()}, {"epoch", id_json(last_.epoch())}};
    if (errors_) {
      errors_->end(report.head);
    } else {
      context_.acknowledge(report, absl::StrCat(applied_text(applied_, last_), ", batches ", batches_));
    }
  }

  absl::Status refusal() const {
    if (refused_ == 0) return absl::OkStatus();
    const std::string message =
        absl::StrCat(refused_, " of ", refused_ + applied_, " rows refused; the first is ", first_refused_);
    return all_unknown_ ? absl::NotFoundError(message) : absl::FailedPreconditionError(message);
  }

  const BulkUpdate& update_;
  const std::string& scene_;
  const BulkOptions& bulk_;
  Context& context_;
  ProgressWriter progress_;
  RowReader* reader_ = nullptr;
  std::unique_ptr<client::UpdateStream> stream_;
  std::deque<InFlight> in_flight_;
  std::vector<v1::UpdateBatch> held_;  // with --one-revision: the batches read so far
  AnsweredRows held_rows_;
  bool timed_out_ = false;  // an ack did not arrive in time; the run does not wait for other acks
  std::optional<ReportStream> errors_;
  std::string first_refused_;
  bool all_unknown_ = true;
  uint64_t batches_ = 0, applied_ = 0, refused_ = 0;
  uint64_t unknown_ = 0;  // number of rows that were sent and neither acknowledged nor refused
  v1::UpdateAck last_;
};

}  // namespace

absl::Status run_bulk_update(const BulkUpdate& update, const std::string& scene, const BulkOptions& bulk,
                             Context& context) {
  return BulkUpdateRun(update, scene, bulk, context).run();
}

}  // namespace locus::cli
