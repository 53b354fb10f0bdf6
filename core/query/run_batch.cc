#include "core/query/run_batch.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/query/block_runner.h"

namespace locus {
namespace {

// Queries that one thread takes at once. A constant, so that pieces do not depend on the number of threads.
constexpr size_t kPieceQueries = 256;
// Pieces whose rows wait for their turn at once: bounds a batch's memory by so many replies. A constant likewise, since
// later pieces learn from it how much room is left.
constexpr size_t kWavePieces = 16;

struct Piece {
  size_t block;
  size_t begin, end;
  BlockResult result;
};

std::vector<Piece> split(const QueryBatch& batch) {
  std::vector<Piece> pieces;
  for (size_t b = 0; b < batch.blocks.size(); ++b) {
    const size_t n = query_count(batch.blocks[b]);
    const auto* lookup = std::get_if<LookupColumns>(&batch.blocks[b].kind);
    // Groups are looked up in one pass over all objects.
    const size_t step = lookup != nullptr && !lookup->groups.empty() ? n : kPieceQueries;
    for (size_t begin = 0; begin < n; begin += step) pieces.push_back({b, begin, std::min(n, begin + step), {}});
  }
  return pieces;
}

absl::StatusOr<std::vector<QueryMoments>> resolve(const SceneSnapshot& snapshot, const QueryBatch& batch) {
  std::vector<QueryMoments> moments;
  moments.reserve(batch.blocks.size());
  for (size_t b = 0; b < batch.blocks.size(); ++b) {
    absl::StatusOr<QueryMoments> resolved =
        QueryMoments::resolve(snapshot, batch.blocks[b], absl::StrCat("blocks[", b, "]"));
    if (!resolved.ok()) return resolved.status();
    moments.push_back(*std::move(resolved));
  }
  return moments;
}

void append_moments(const QueryMoments& moments, size_t queries, BlockResult& to) {
  if (!moments.asks_past()) return;
  for (size_t i = 0; i < queries; ++i) {
    to.resolved_ticks.push_back(moments.time(i).tick);
    to.resolved_fractions.push_back(moments.time(i).fraction);
    if (moments.clamped(i)) to.clamped.push_back(static_cast<uint32_t>(i));
  }
}

// Puts pieces together in order and cuts rows where the reply is full.
class Assembly {
 public:
  explicit Assembly(const QueryBatch& batch) : batch_(batch), room_(reply_limit(batch) - fixed_reply_bytes(batch)) {
    result_.blocks.resize(batch.blocks.size());
  }

  void add(const Piece& piece) {
    const QueryBlock& block = batch_.blocks[piece.block];
    BlockResult& to = result_.blocks[piece.block];
    const ColumnSet columns = returned_columns(block);
    if (row_layout(block) == RowLayout::kCounted) {
      add_counted(piece, columns, to);
    } else {
      append_rows(piece.result, 0, row_layout(block) == RowLayout::kDense ? piece.end - piece.begin : 0, columns, to);
      to.hits += piece.result.hits;
      to.truncated.insert(to.truncated.end(), piece.result.truncated.begin(), piece.result.truncated.end());
    }
    to.work += piece.result.work;
    to.nanoseconds += piece.result.nanoseconds;
    result_.work += piece.result.work;
    result_.nanoseconds += piece.result.nanoseconds;
  }

  // Bytes of rows that still fit.
  uint64_t room() const { return room_; }
  BatchResult finish() { return std::move(result_); }

 private:
  void add_counted(const Piece& piece, ColumnSet columns, BlockResult& to) {
    const uint32_t bytes = row_bytes(columns);
    size_t row = 0;
    auto cut = piece.result.truncated.begin();
    for (size_t i = 0; i < piece.result.counts.size(); ++i) {
      const auto query = static_cast<uint32_t>(piece.begin + i);
      const uint32_t rows = piece.result.counts[i];
      const auto kept = static_cast<uint32_t>(std::min<uint64_t>(rows, room_ / bytes));
      append_rows(piece.result, row, kept, columns, to);
      to.counts.push_back(kept);
      room_ -= uint64_t{kept} * bytes;
      row += rows;
      const bool was_cut = cut != piece.result.truncated.end() && *cut == query;
      if (was_cut) ++cut;
      if (was_cut || kept < rows) to.truncated.push_back(query);
    }
  }

  const QueryBatch& batch_;
  uint64_t room_;
  BatchResult result_;
};

}  // namespace

absl::StatusOr<BatchResult> run_batch(const SceneSnapshot& snapshot, const QueryBatch& batch,
                                      const RunOptions& options) {
  const absl::StatusOr<std::vector<QueryMoments>> moments = resolve(snapshot, batch);
  if (!moments.ok()) return moments.status();
  BatchControl control(batch.max_work, options.stop);
  std::vector<Piece> pieces = split(batch);
  Assembly assembly(batch);
  const auto run_piece = [&](Piece& piece) {
    const uint64_t start = options.clock ? options.clock() : 0;
    QueryTask task(snapshot, control, options.brute_force);
    piece.result = BlockRunner(task, batch.blocks[piece.block], (*moments)[piece.block], assembly.room())
                       .run(piece.begin, piece.end);
    if (options.clock) piece.result.nanoseconds = options.clock() - start;
  };
  for (size_t first = 0; first < pieces.size() && !control.stopped(); first += kWavePieces) {
    const size_t count = std::min(kWavePieces, pieces.size() - first);
    if (options.parallel_for) {
      options.parallel_for(count, [&](size_t number) { run_piece(pieces[first + number]); });
    } else {
      for (size_t number = 0; number < count; ++number) run_piece(pieces[first + number]);
    }
    for (size_t number = first; number < first + count; ++number) {
      assembly.add(pieces[number]);
      pieces[number].result = {};
    }
  }
  if (control.stopped()) return control.status();
  BatchResult result = assembly.finish();
  for (size_t b = 0; b < batch.blocks.size(); ++b)
    append_moments((*moments)[b], query_count(batch.blocks[b]), result.blocks[b]);
  return result;
}

}  // namespace locus
