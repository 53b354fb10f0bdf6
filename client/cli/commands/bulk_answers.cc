#include "client/cli/commands/bulk_answers.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/commands/bulk_query.h"
#include "client/lib/result_rows.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr size_t kAnswerWidthRows = 1000;    // number of first rows that determine a table's column widths
constexpr uint64_t kListedTruncated = 1000;  // maximum number of truncated queries that the report lists

std::vector<std::string> keys_of(const BulkQuery& query) {
  if (query.answer == BulkAnswer::kRows) return row_keys(query.layout);
  std::vector<std::string> keys = {query.layout.query, query.answer == BulkAnswer::kHits ? "hit" : "seen"};
  if (query.layout.as_of) keys.emplace_back("as_of");
  return keys;
}

absl::Status no_fit() { return absl::DataLossError("the server's answer does not match the query"); }

}  // namespace

BulkAnswers::BulkAnswers(const BulkQuery& query, bool follow, Context& context)
    : query_(query),
      follow_(follow),
      context_(context),
      report_(context.out(), context.options().format,
              {.rows_name = query.rows_name, .keys = keys_of(query), .width_rows = kAnswerWidthRows}) {}

absl::Status BulkAnswers::write(const v1::QueryResult& result, const SentRows& sent,
                                const std::vector<client::Double3>& frames) {
  if (static_cast<size_t>(result.blocks_size()) != frames.size()) return no_fit();
  note(result);
  for (size_t i = 0; i < frames.size(); ++i) {
    const size_t end = i + 1 < frames.size() ? sent.list_starts[i + 1] : sent.rows();
    RowLayout layout = query_.layout;
    layout.frame = frames[i];
    layout.first_query = sent.first_row + sent.list_starts[i];
    RETURN_IF_ERROR(write_block(result.blocks(static_cast<int>(i)), end - sent.list_starts[i], layout));
  }
  context_.out().flush();
  if (!context_.out()) return absl::UnknownError("cannot write the output");
  rows_ += sent.rows();
  return absl::OkStatus();
}

absl::Status BulkAnswers::write_block(const v1::BlockResult& block, size_t rows, RowLayout layout) {
  for (const uint32_t query : block.truncated()) {
    if (truncated_++ < kListedTruncated) truncated_rows_.push_back(layout.first_query + query);
  }
  clamped_ += static_cast<size_t>(block.clamped_size());
  if (query_.answer == BulkAnswer::kSeen) {
    ASSIGN_OR_RETURN(const client::SightMatrix matrix, client::SightMatrix::of(block, rows, 1));
    for (size_t i = 0; i < rows; ++i) add_bit(block, i, layout, "seen", matrix.seen(i, 0) != 0);
    return absl::OkStatus();
  }
  if (query_.answer == BulkAnswer::kHits) {
    ASSIGN_OR_RETURN(const client::AnyHits hits, client::AnyHits::of(block));
    if (hits.size() != rows) return no_fit();
    for (size_t i = 0; i < rows; ++i) add_bit(block, i, layout, "hit", hits.hit(i));
    return absl::OkStatus();
  }
  ASSIGN_OR_RETURN(const client::ResultRows answered, client::ResultRows::of(block));
  if (answered.queries() != rows) return no_fit();
  ASSIGN_OR_RETURN(const std::vector<Json> lines, rows_json(block, layout));
  for (const Json& line : lines) report_.add(line);
  return absl::OkStatus();
}

void BulkAnswers::add_bit(const v1::BlockResult& block, size_t query, const RowLayout& layout, const char* key,
                          bool value) {
  Json row = {{layout.query, layout.first_query + query}, {key, value}};
  if (layout.as_of) {
    const Json times = resolved_json(block);
    row["as_of"] = query < times.size() ? times[query] : Json();
  }
  report_.add(row);
}

void BulkAnswers::note(const v1::QueryResult& result) {
  if (!revision_) {
    Json head = {{"epoch", id_json(result.epoch())}};
    if (!follow_) head.update({{"revision", result.revision()}, {"tick", result.tick()}});
    report_.begin(head);
    first_revision_ = result.revision();
  }
  // With `follow`, an answer may have an older revision than an answer before it: keep the newest revision and its
  // tick.
  if (!revision_ || result.revision() > revision_->revision) tick_ = result.tick();
  if (!revision_ || result.revision() > revision_->revision) revision_ = {result.epoch(), result.revision()};
  if (!result.has_work()) return;
  has_work_ = true;
  work_.set_nodes(work_.nodes() + result.work().nodes());
  work_.set_cells(work_.cells() + result.work().cells());
  work_.set_tests(work_.tests() + result.work().tests());
  work_.set_nanoseconds(work_.nanoseconds() + result.work().nanoseconds());
}

Json BulkAnswers::tail() const {
  Json tail = Json::object();
  if (follow_) {
    tail["first_revision"] = first_revision_;
    tail["revision"] = revision_->revision;
    tail["tick"] = tick_;
  }
  if (truncated_ > 0) tail["truncated"] = truncated_rows_;
  if (truncated_ > kListedTruncated) tail["truncated_in_all"] = truncated_;
  if (clamped_ > 0) tail["clamped_in_all"] = clamped_;
  if (has_work_) tail["work"] = work_json(work_);
  return tail;
}

void BulkAnswers::end() {
  if (!revision_) return;
  report_.end(tail());
  context_.out().flush();
  const Format format = context_.options().format;
  if (truncated_ == 0 || (format != Format::kCsv && format != Format::kNdjson)) return;
  context_.err() << "warning: " << truncated_ << " rows found more than was reported, the first is "
                 << query_.layout.query << ' ' << truncated_rows_.front() << ": raise --max-results or lower --batch\n";
}

}  // namespace locus::cli
