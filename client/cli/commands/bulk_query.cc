#include "client/cli/commands/bulk_query.h"

#include <chrono>
#include <cmath>
#include <deque>
#include <future>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/commands/bulk_answers.h"
#include "client/cli/failure.h"
#include "client/cli/progress.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr double kFrameGrid = 16384;

bool is_exact_float(double value) { return static_cast<double>(static_cast<float>(value)) == value; }

client::Double3 frame_of_row(const BulkQuery& query, const RowBatch& batch, size_t row) {
  if (!query.has_position) return {};
  const RowColumn& positions = batch.columns[0];
  return frame_of(positions.numbers[3 * row], positions.numbers[3 * row + 1], positions.numbers[3 * row + 2]);
}

bool same(const client::Double3& a, const client::Double3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

BulkQuery with_times(BulkQuery query, const QueryOptions& options, const Context& context) {
  query.layout.as_of = rows_have_time(options.past, context.format());
  return query;
}

class BulkQueryRun {
 public:
  BulkQueryRun(const BulkQuery& query, const QueryOptions& options, const BulkOptions& bulk, Context& context)
      : query_(with_times(query, options, context)),
        options_(options),
        bulk_(bulk),
        context_(context),
        progress_(start_progress(context)),
        answers_(query_, bulk.follow, context) {}

  absl::Status run() {
    // While a script is only checked, do not open the input: an earlier line of the script may create the file, and a
    // pipe can be read only once.
    if (context_.lines() == Lines::kScriptCheck) return absl::OkStatus();
    ASSIGN_OR_RETURN(const std::unique_ptr<RowReader> reader, open_rows(bulk_, query_.schema));
    reader_ = reader.get();
    if (context_.batch_sink()) return pass_all();
    ASSIGN_OR_RETURN(client::Client* const client, context_.connect());
    stream_ = client->query_stream(options_.scene, {.max_in_flight = static_cast<int>(kBulkWindow), .reconnect = {}});
    progress_.begin({.action = "querying", .subject = reader_->name(), .unit = "rows"});
    absl::Status status = ask_all();
    // After an error of the input, still write the answers to the batches that were already sent. After an error of the
    // server, do not wait for further answers.
    while (!refused_ && !in_flight_.empty()) status.Update(write_front());
    progress_.hide();
    answers_.end();
    if (status.ok()) return stream_->close();
    if (answers_.rows() == 0) return status;
    return in_words(status, absl::StrCat(status.message(), "; ", answers_.rows(), " rows before it were answered"));
  }

 private:
  struct InFlight {
    SentRows sent;
    std::future<absl::StatusOr<v1::QueryResult>> answer;
    std::vector<client::Double3> frames;  // one per block
  };

  // Passes all batches to the context's batch sink.
  absl::Status pass_all() {
    RowBatch batch;
    while (true) {
      ASSIGN_OR_RETURN(const BatchEnd end,
                       reader_->next(bulk_.batch.value_or(kDefaultBulkBatch), Patience::kWait, batch));
      for (size_t begin = 0; begin < batch.rows();) {
        InFlight message;
        client::QueryBuilder builder;
        begin = add_blocks(batch, begin, message, builder);
        RETURN_IF_ERROR(
            context_.batch_sink()(builder.build(), absl::StrCat(reader_->name(), ":", message.sent.line_range())));
      }
      if (end == BatchEnd::kEnd) return absl::OkStatus();
    }
  }

  absl::Status ask_all() {
    RowBatch batch;
    bool asked = false;
    while (true) {
      const Patience patience = in_flight_.empty() ? Patience::kWait : Patience::kPause;
      ASSIGN_OR_RETURN(const BatchEnd end, reader_->next(bulk_.batch.value_or(kDefaultBulkBatch), patience, batch));
      // If the input has no rows, send one empty batch: the server checks that the scene exists, and returns its
      // revision.
      if (batch.rows() > 0 || (end == BatchEnd::kEnd && !asked)) {
        asked = true;
        RETURN_IF_ERROR(send(batch));
      }
      RETURN_IF_ERROR(write_answers(end));
      if (end == BatchEnd::kEnd) return absl::OkStatus();
    }
  }

  // Sends the rows of `batch`, in several messages if they need more blocks than a message may have.
  absl::Status send(const RowBatch& batch) {
    size_t begin = 0;
    do {
      while (in_flight_.size() >= kBulkWindow || (!in_flight_.empty() && !answers_.revision() && !bulk_.follow)) {
        RETURN_IF_ERROR(write_front());
      }
      InFlight& next = in_flight_.emplace_back();
      LOCUS_CHECK_LE(in_flight_.size(), kBulkWindow);
      client::QueryBuilder builder;
      apply_to_batch(options_, context_, builder);
      set_view(builder);
      builder.max_reply_bytes(limits::kMaxReplyBytes);
      begin = add_blocks(batch, begin, next, builder);
      next.answer = stream_->send(builder.build());
    } while (begin < batch.rows());
    return absl::OkStatus();
  }

  void set_view(client::QueryBuilder& builder) const {
    if (!answers_.revision()) return;
    if (bulk_.follow) {
      builder.at_least(*answers_.revision());
    } else {
      builder.exactly(*answers_.revision());
    }
  }

  // Adds rows of `batch` to `message`, beginning with row `begin`, until the message has kMaxBlocks blocks. Consecutive
  // rows with the same frame form one block. Returns the index of the first row that was not added.
  size_t add_blocks(const RowBatch& batch, size_t begin, InFlight& message, client::QueryBuilder& builder) const {
    message.sent.first_row = batch.first_row + begin;
    const size_t first = begin;
    while (begin < batch.rows() && message.frames.size() < limits::kMaxBlocks) {
      const client::Double3 frame = frame_of_row(query_, batch, begin);
      size_t end = begin + 1;
      while (end < batch.rows() && same(frame_of_row(query_, batch, end), frame)) ++end;
      const RowSpan rows = {begin, end};
      BlockRows block = {batch, rows, frame, {}};
      if (query_.has_position) block.offsets = offsets_of(batch.columns[0], rows, frame);
      query_.add_block(block, builder);
      message.frames.push_back(frame);
      message.sent.list_starts.push_back(begin - first);
      begin = end;
    }
    const auto lines = batch.lines.begin();
    message.sent.lines.assign(lines + static_cast<std::ptrdiff_t>(first), lines + static_cast<std::ptrdiff_t>(begin));
    return begin;
  }

  // Writes the answers that have arrived, in the order of the queue, up to the first that has not arrived. If the input
  // has no data ready or has ended, waits for all answers instead: a process that feeds rows through a pipe may wait
  // for their answers before it sends more rows.
  absl::Status write_answers(BatchEnd end) {
    while (!in_flight_.empty()) {
      if (end == BatchEnd::kFull &&
          in_flight_.front().answer.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
        return absl::OkStatus();
      }
      RETURN_IF_ERROR(write_front());
    }
    return absl::OkStatus();
  }

  absl::Status write_front() {
    InFlight front = std::move(in_flight_.front());
    in_flight_.pop_front();
    const double seconds = context_.options().timeout_seconds.value_or(kBulkAnswerSeconds);
    if (front.answer.wait_for(std::chrono::duration<double>(seconds)) != std::future_status::ready) {
      refused_ = true;
      return absl::DeadlineExceededError(
          absl::StrCat(reader_->name(), ":", front.sent.line_range(), ": no answer within ", seconds, " s"));
    }
    const absl::StatusOr<v1::QueryResult> result = front.answer.get();
    progress_.hide();
    absl::Status status =
        result.ok() ? answers_.write(*result, front.sent, front.frames) : explained(result.status(), front.sent);
    refused_ = !status.ok();
    progress_.update_share(answers_.rows(), reader_->share_read());
    progress_.show();
    return status;
  }

  absl::Status explained(const absl::Status& status, const SentRows& sent) const {
    const absl::Status refusal = refused_rows(status, reader_->name(), sent);
    if (!absl::IsOutOfRange(status) || !answers_.revision()) return refusal;
    return in_words(refusal,
                    absl::StrCat(refusal.message(), " (the first rows were answered at revision ",
                                 answers_.revision()->revision, "; --follow lets later ones see newer revisions)"));
  }

  const BulkQuery query_;
  const QueryOptions& options_;
  const BulkOptions& bulk_;
  Context& context_;
  ProgressWriter progress_;
  BulkAnswers answers_;
  RowReader* reader_ = nullptr;
  std::unique_ptr<client::QueryStream> stream_;
  std::deque<InFlight> in_flight_;
  bool refused_ = false;
};

}  // namespace

client::Double3 frame_of(double x, double y, double z) {
  if (is_exact_float(x) && is_exact_float(y) && is_exact_float(z)) return {};
  return {std::round(x / kFrameGrid) * kFrameGrid, std::round(y / kFrameGrid) * kFrameGrid,
          std::round(z / kFrameGrid) * kFrameGrid};
}

std::vector<float> offsets_of(const RowColumn& positions, RowSpan rows, const client::Double3& frame) {
  std::vector<float> offsets;
  offsets.reserve(3 * (rows.end - rows.begin));
  for (size_t row = rows.begin; row < rows.end; ++row) {
    offsets.push_back(static_cast<float>(positions.numbers[3 * row] - frame.x));
    offsets.push_back(static_cast<float>(positions.numbers[3 * row + 1] - frame.y));
    offsets.push_back(static_cast<float>(positions.numbers[3 * row + 2] - frame.z));
  }
  return offsets;
}

Field at_field() {
  return {.name = "at", .kind = FieldKind::kCoordinate, .parts = "xyz", .aliases = {"position"}, .required = true};
}

void add_filter_fields(const QueryOptions& options, RowSchema& schema) {
  schema.push_back(column_or_option({.name = "mask", .kind = FieldKind::kBits}, options.masks, "--mask"));
  schema.push_back(
      column_or_option({.name = "ignore_group", .kind = FieldKind::kId}, options.ignore_groups, "--ignore-group"));
  schema.push_back(column_or_option({.name = "self_id", .kind = FieldKind::kId}, options.self_ids, "--self-id"));
  schema.push_back(
      column_or_option({.name = "only_group", .kind = FieldKind::kId}, options.only_groups, "--only-group"));
  schema.push_back(column_or_option({.name = "tag", .kind = FieldKind::kId}, options.tags, "--tag"));
  Field mask = column_or_option({.name = "tag_mask", .kind = FieldKind::kId}, options.tag_masks, "--tag-mask");
  if (options.tags.empty()) mask.needs = "tag";
  schema.push_back(std::move(mask));
}

TagColumns tag_columns(const QueryOptions& options, const BlockRows& rows, size_t tag_field) {
  const RowColumn &tag = rows.batch.columns[tag_field], &mask = rows.batch.columns[tag_field + 1];
  if (!tag.any() && !mask.any()) return {values_of(options.tags), values_of(options.tag_masks)};
  const uint64_t option_tag = options.tags.empty() ? 0 : options.tags.front().value;
  const uint64_t option_mask = options.tag_masks.empty() ? ~uint64_t{0} : options.tag_masks.front().value;
  TagColumns columns;
  for (size_t row = rows.rows.begin; row < rows.rows.end; ++row) {
    const bool given = tag.given[row] != 0 || !options.tags.empty();
    columns.tags.push_back(tag.given[row] != 0 ? tag.integers[row] : option_tag);
    columns.masks.push_back(!given ? 0 : mask.given[row] != 0 ? mask.integers[row] : option_mask);
  }
  return columns;
}

absl::Status check(const QueryOptions& options, const BulkOptions& bulk) {
  absl::Status status = check(options);
  status.Update(check(bulk));
  status.Update(at_most_one(options.masks, "--mask"));
  status.Update(at_most_one(options.ignore_groups, "--ignore-group"));
  status.Update(at_most_one(options.self_ids, "--self-id"));
  status.Update(at_most_one(options.tags, "--tag"));
  status.Update(at_most_one(options.tag_masks, "--tag-mask"));
  status.Update(at_most_one(options.past.as_of, "--as-of"));
  if (status.ok() && options.after_id.value != 0)
    return usage_error("--after-id continues one truncated answer; it cannot be combined with an input");
  if (status.ok() && (!options.anchors.empty() || options.count_only))
    return usage_error("--anchor and --count-only cannot be combined with an input");
  if (status.ok() && bulk.follow && options.exactly) return usage_error("give --exactly or --follow, not both");
  return status;
}

absl::Status run_bulk_query(const BulkQuery& query, const QueryOptions& options, const BulkOptions& bulk,
                            Context& context) {
  return BulkQueryRun(query, options, bulk, context).run();
}

}  // namespace locus::cli
