#include "core/query/run/batch_run.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/query/run/rows.h"

namespace locus {
namespace {

// Maximum number of queries of a chunk. Chunks that turn out to be expensive are split further.
constexpr size_t kChunkQueries = 256;
// Maximum number of sight segments in a chunk, unless a single viewer has more. Without this limit, a block of few
// viewers would be a single chunk, on which only one thread at a time could work.
constexpr size_t kChunkSegments = 1024;

size_t max_chunk_queries(const QueryBlock& block) {
  const auto* const lookup = std::get_if<LookupColumns>(&block.kind);
  // All groups of a block are looked up at once, so the block is not divided into chunks.
  if (lookup != nullptr && !lookup->groups.empty()) return limits::kMaxQueries;
  if (const auto* const sight = std::get_if<SightColumns>(&block.kind)) {
    const size_t segments = sight->bytes_per_viewer() * sight->samples_per_target() * sight->eyes_per_viewer();
    return std::clamp<size_t>(kChunkSegments / std::max<size_t>(segments, 1), 1, kChunkQueries);
  }
  return kChunkQueries;
}

void copy_rows(const CollectedRows& from, size_t first, size_t rows, const RowSpans& to) {
  for_each_column_array([&](const auto& array) {
    if (array.get(to) == nullptr) return;
    std::copy_n(array.get(from).data() + first * array.width, rows * array.width, array.get(to));
  });
}

void write_times(const QueryTimes& times, size_t block, size_t queries, AnswerSink& answer) {
  if (!times.asks_past() || queries == 0) return;
  const TimeSpans to = answer.add_times(block, queries);
  for (size_t i = 0; i < queries; ++i) {
    to.ticks[i] = times.time(i).tick;
    to.fractions[i] = times.time(i).fraction;
    if (times.clamped(i)) *answer.add_clamped(block, 1) = static_cast<uint32_t>(i);
  }
}

}  // namespace

absl::StatusOr<std::unique_ptr<BatchRun>> BatchRun::prepare(const SceneSnapshot& snapshot, const QueryBatch& batch,
                                                            RunOptions options, AnswerSink& answer) {
  std::vector<QueryTimes> times;
  times.reserve(batch.blocks.size());
  InterpolationBudget budget(limits::kMaxInterpolatedBytes);
  for (size_t b = 0; b < batch.blocks.size(); ++b) {
    ASSIGN_OR_RETURN(QueryTimes resolved,
                     QueryTimes::resolve(snapshot, batch.blocks[b], absl::StrCat("blocks[", b, "]"), budget));
    times.push_back(std::move(resolved));
  }
  std::unique_ptr<BatchRun> run(new BatchRun(snapshot, batch, std::move(options), answer));
  run->interpolated_bytes_ = budget.taken();
  for (QueryTimes& block_times : times) run->add_block(std::move(block_times));
  const MutexLock lock(run->mutex_);
  LOCUS_DCHECK_EQ(run->blocks_.size(), batch.blocks.size());
  run->skip_empty_blocks();
  LOCUS_DCHECK_CALL(run->check_invariants());
  return run;
}

BatchRun::BatchRun(const SceneSnapshot& snapshot, const QueryBatch& batch, RunOptions options, AnswerSink& answer)
    : snapshot_(snapshot),
      batch_(batch),
      options_(std::move(options)),
      answer_(answer),
      control_(batch.max_work, options_.stop),
      free_bytes_(reply_limit(batch) - fixed_reply_bytes(batch)) {
  LOCUS_DCHECK_LE(fixed_reply_bytes(batch), reply_limit(batch));
}

void BatchRun::add_block(QueryTimes times) {
  const size_t index = blocks_.size();
  const QueryBlock& block = batch_.blocks[index];
  const size_t queries = query_count(block);
  Block& to = blocks_.emplace_back(block, std::move(times), queries, max_chunk_queries(block));
  if (row_layout(block) == RowLayout::kDense)
    to.output.rows = answer_.add_rows(index, returned_columns(block), queries);
  if (row_layout(block) == RowLayout::kBytes) to.output.bytes = answer_.add_hits(index, queries);
  if (row_layout(block) == RowLayout::kMatrix)
    to.output.bytes = answer_.add_matrix(index, queries * bytes_per_query(block));
  const std::vector<uint32_t>& unanchored = to.origins.unanchored();
  if (!unanchored.empty())
    std::copy(unanchored.begin(), unanchored.end(), answer_.add_unanchored(index, unanchored.size()));
  write_times(to.times, index, queries, answer_);
}

QueryCost BatchRun::cost() const {
  QueryCost sum;
  for (const Block& block : blocks_) {
    sum.work += block.cost.work;
    sum.nanoseconds += block.cost.nanoseconds;
  }
  return sum;
}

Progress BatchRun::work(uint64_t nanoseconds) {
  const uint64_t start = now();
  Chunks::iterator chunk;
  {
    const MutexLock lock(mutex_);
    if (!can_begin()) return progress();
    chunk = begin_chunk();
  }
  TimingSpan timing = begin_timing(chunk->block);
  const uint64_t work_time_before = timing.start;
  while (true) {
    end_chunk(chunk, run(*chunk));
    // Both wall time and CPU time must have reached the limit: a thread that was preempted has worked for less than the
    // wall time.
    const bool time_is_up =
        !options_.clock || (now() - start >= nanoseconds && work_time() - work_time_before >= nanoseconds);
    const MutexLock lock(mutex_);
    LOCUS_DCHECK_GT(active_threads_, 0u);
    --active_threads_;
    const Progress reached = progress();
    LOCUS_DCHECK_CALL(check_invariants());
    const bool leave = reached != Progress::kMore || time_is_up;
    if (!leave) chunk = begin_chunk();
    if (leave || chunk->block != timing.block) end_timing(timing);
    if (leave) return reached;
    if (chunk->block != timing.block) timing = begin_timing(chunk->block);
  }
}

// Limits the number of chunks that run or wait to be written out, and so the memory of their rows. The first chunk in
// batch order may always begin, since all other chunks are written out after it.
bool BatchRun::can_begin() const {
  if (control_.stopped()) return false;
  const size_t begun = chunks_.size() - unstarted_.size();
  if (!unstarted_.empty()) return begun < 2 * kMaxChunks || unstarted_.front() == chunks_.begin();
  return next_block_ < blocks_.size() && begun < kMaxChunks;
}

BatchRun::Chunks::iterator BatchRun::begin_chunk() {
  LOCUS_DCHECK(can_begin());
  ++active_threads_;
  if (!unstarted_.empty()) return pop_unstarted();
  const Block& block = blocks_[next_block_];
  const size_t end = std::min(block.queries, next_query_ + block.max_chunk_queries);
  chunks_.push_back({next_block_, next_query_, end});
  next_query_ = end;
  if (end == block.queries) {
    ++next_block_;
    next_query_ = 0;
    skip_empty_blocks();
  }
  LOCUS_DCHECK_CALL(check_invariants());
  return std::prev(chunks_.end());
}

BatchRun::Chunks::iterator BatchRun::pop_unstarted() {
  LOCUS_DCHECK(!unstarted_.empty());
  const Chunks::iterator chunk = unstarted_.front();
  unstarted_.erase(unstarted_.begin());
  LOCUS_DCHECK_CALL(check_invariants());
  return chunk;
}

void BatchRun::skip_empty_blocks() {
  while (next_block_ < blocks_.size() && blocks_[next_block_].queries == 0) ++next_block_;
}

size_t BatchRun::run(Chunk& chunk) {
  Block& block = blocks_[chunk.block];
  QueryTask task(snapshot_, control_, options_.brute_force);
  BlockRunner runner(task, batch_.blocks[chunk.block], block.times, block.origins, block.output,
                     free_bytes_.load(std::memory_order_relaxed));
  const size_t reached = runner.run(chunk.begin, chunk.end);
  chunk.rows = runner.take_rows();
  chunk.work = task.work();
  work_done_.fetch_add(chunk.work.nodes + chunk.work.cells + chunk.work.tests, std::memory_order_relaxed);
  return reached;
}

void BatchRun::end_chunk(Chunks::iterator chunk, size_t reached) {
  {
    const MutexLock lock(mutex_);
    LOCUS_DCHECK(!chunk->done);
    LOCUS_DCHECK_LT(chunk->begin, reached);
    LOCUS_DCHECK_LE(reached, chunk->end);
    if (reached < chunk->end) split(chunk, reached);
    chunk->done = true;
    if (writing_ || !chunks_.front().done) return;
    writing_ = true;
  }
  write_out();
}

void BatchRun::split(Chunks::iterator chunk, size_t reached) {
  const size_t middle = reached + (chunk->end - reached) / 2;
  insert_unstarted(chunk, middle, chunk->end);
  if (reached < middle) insert_unstarted(chunk, reached, middle);
  chunk->end = reached;
  LOCUS_DCHECK_CALL(check_invariants());
}

void BatchRun::insert_unstarted(Chunks::iterator before, size_t begin, size_t end) {
  const Chunks::iterator chunk = chunks_.insert(std::next(before), {before->block, begin, end});
  const auto precedes = [](Chunks::iterator a, Chunks::iterator b) {
    return std::tie(a->block, a->begin) < std::tie(b->block, b->begin);
  };
  unstarted_.insert(std::upper_bound(unstarted_.begin(), unstarted_.end(), chunk, precedes), chunk);
}

void BatchRun::write_out() {
  while (true) {
    Chunks ready;
    {
      const MutexLock lock(mutex_);
      LOCUS_DCHECK(writing_);
      const auto first_open =
          std::find_if(chunks_.begin(), chunks_.end(), [](const Chunk& chunk) { return !chunk.done; });
      ready.splice(ready.end(), chunks_, chunks_.begin(), first_open);
      if (ready.empty()) {
        writing_ = false;
        LOCUS_DCHECK_CALL(check_invariants());
        return;
      }
    }
    if (control_.stopped()) continue;
    for (const Chunk& chunk : ready) write(chunk);
  }
}

void BatchRun::write(const Chunk& chunk) {
  LOCUS_DCHECK(chunk.done);
  Block& block = blocks_[chunk.block];
  block.cost.work += chunk.work;
  if (row_layout(batch_.blocks[chunk.block]) == RowLayout::kCounted) return write_counted(chunk);
  const std::vector<uint32_t>& cut = chunk.rows.truncated;
  if (!cut.empty()) std::copy(cut.begin(), cut.end(), answer_.add_truncated(chunk.block, cut.size()));
}

// Writes the counts and rows of a chunk. Drops rows that do not fit the reply and lists their queries as truncated.
void BatchRun::write_counted(const Chunk& chunk) {
  LOCUS_DCHECK_EQ(chunk.rows.counts.size(), chunk.end - chunk.begin);
  if (batch_.blocks[chunk.block].count_only) return write_counts(chunk);
  const ColumnSet columns = returned_columns(batch_.blocks[chunk.block]);
  const uint32_t bytes = row_bytes(columns);
  uint64_t free_bytes = free_bytes_.load(std::memory_order_relaxed);
  uint32_t* const counts = answer_.add_counts(chunk.block, chunk.rows.counts.size());
  size_t first = 0, row = 0;  // rows [first, row) of the chunk fit the reply and are not copied yet
  const auto copy = [&] {
    if (row != first) copy_rows(chunk.rows, first, row - first, answer_.add_rows(chunk.block, columns, row - first));
  };
  auto cut = chunk.rows.truncated.begin();
  for (size_t i = 0; i < chunk.rows.counts.size(); ++i) {
    const auto query = static_cast<uint32_t>(chunk.begin + i);
    const uint32_t rows = chunk.rows.counts[i];
    const auto kept = static_cast<uint32_t>(std::min<uint64_t>(rows, free_bytes / bytes));
    counts[i] = kept;
    free_bytes -= uint64_t{kept} * bytes;
    row += kept;
    const bool was_cut = cut != chunk.rows.truncated.end() && *cut == query;
    if (was_cut) ++cut;
    if (was_cut || kept < rows) *answer_.add_truncated(chunk.block, 1) = query;
    if (kept == rows) continue;
    copy();
    row += rows - kept;
    first = row;
  }
  copy();
  LOCUS_DCHECK(cut == chunk.rows.truncated.end());
  LOCUS_DCHECK_LE(free_bytes, free_bytes_.load(std::memory_order_relaxed));
  free_bytes_.store(free_bytes, std::memory_order_relaxed);
}

// Writes the counts of a chunk of a block with count_only, which has no rows.
void BatchRun::write_counts(const Chunk& chunk) {
  const std::vector<uint32_t>&counts = chunk.rows.counts, &cut = chunk.rows.truncated;
  std::copy(counts.begin(), counts.end(), answer_.add_counts(chunk.block, counts.size()));
  if (!cut.empty()) std::copy(cut.begin(), cut.end(), answer_.add_truncated(chunk.block, cut.size()));
}

Progress BatchRun::progress() {
  if (can_begin()) return Progress::kMore;
  if (active_threads_ > 0 || done_) return Progress::kBegun;
  done_ = true;
  return Progress::kDone;
}

void BatchRun::check_invariants() const {
  size_t open = 0;
  const Chunk* before = nullptr;
  for (const Chunk& chunk : chunks_) {
    LOCUS_DCHECK_LT(chunk.begin, chunk.end);
    LOCUS_DCHECK_LE(chunk.end, blocks_[chunk.block].queries);
    if (before != nullptr) LOCUS_DCHECK_CALL(check_adjacent(before->block, before->end, chunk.block, chunk.begin));
    open += chunk.done ? 0 : 1;
    before = &chunk;
  }
  if (before != nullptr) LOCUS_DCHECK_CALL(check_adjacent(before->block, before->end, next_block_, next_query_));
  LOCUS_DCHECK_LE(next_block_, blocks_.size());
  LOCUS_DCHECK(next_block_ == blocks_.size() ? next_query_ == 0 : next_query_ < blocks_[next_block_].queries);
  LOCUS_DCHECK_LE(unstarted_.size(), open);
  LOCUS_DCHECK_LE(open - unstarted_.size(), size_t{active_threads_});
  for (size_t i = 0; i < unstarted_.size(); ++i) {
    LOCUS_DCHECK(!unstarted_[i]->done);
    if (i == 0) continue;
    const Chunk &a = *unstarted_[i - 1], &b = *unstarted_[i];
    LOCUS_DCHECK(std::tie(a.block, a.begin) < std::tie(b.block, b.begin));
  }
  LOCUS_DCHECK(!done_ || active_threads_ == 0);
  LOCUS_DCHECK(!done_ || chunks_.empty() || control_.stopped());
}

void BatchRun::check_adjacent(size_t before, size_t end, size_t block, size_t begin) const {
  if (before == block) return LOCUS_CHECK(end == begin);
  LOCUS_DCHECK_LT(before, block);
  LOCUS_DCHECK_EQ(end, blocks_[before].queries);
  LOCUS_DCHECK_EQ(begin, size_t{0});
  for (size_t i = before + 1; i < block; ++i) LOCUS_DCHECK_EQ(blocks_[i].queries, size_t{0});
}

}  // namespace locus
