// Execution of a checked batch against one snapshot, in chunks that any thread may run. Used by the scheduler, which
// assigns threads to batches and limits the time of each thread. The result depends only on the snapshot and the batch:
// the sizes of chunks, their assignment to threads and the order in which chunks finish do not change any byte of the
// result. The only exception is a batch that ends early because its max_work is used up.
//
// Threads: any number of threads may call work() concurrently. All other members may be called only before the first or
// after the last call of work(). Memory: at most about 2 * kMaxChunks chunks have rows that wait to be written out in
// batch order, and the rows of each chunk are limited by the size of a reply.
//
// Invariants: chunks_ covers consecutive queries in batch order, from the first query that is not written out to
// (next_block_, next_query_). Every chunk is unstarted, running or done. active_threads_ is the sum of two numbers: the
// running chunks, and the threads in work() that have finished a chunk and have not yet begun another one. One thread
// at a time runs write_out(). work() returns kDone once.
#ifndef LOCUS_CORE_QUERY_RUN_BATCH_RUN_H_
#define LOCUS_CORE_QUERY_RUN_BATCH_RUN_H_

#include <atomic>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/check.h"
#include "core/base/mutex.h"
#include "core/query/kinds/query_origins.h"
#include "core/query/kinds/query_task.h"
#include "core/query/kinds/query_times.h"
#include "core/query/query_batch.h"
#include "core/query/run/answer_sink.h"
#include "core/query/run/block_runner.h"
#include "core/query/run/progress.h"
#include "core/scene/snapshot/scene_snapshot.h"

namespace locus {

struct RunOptions {
  // Function that is called before and after each chunk and after every limits::kTestsBetweenChecks primitive tests, on
  // any thread. If it returns a status that is not OK, the batch ends with this status. If `stop` is empty, the batch
  // is never stopped.
  std::function<absl::Status()> stop;
  // Wall clock in nanoseconds with any origin, read at the start of each call of work() and after each chunk, on any
  // thread. If `clock` is empty, each call of work() runs one chunk.
  std::function<uint64_t()> clock;
  // CPU time of the calling thread in nanoseconds. `work_clock` may be slow: each call of work() calls `work_clock`
  // only about twice for each block on which the call works. If `work_clock` is empty, `clock` is used instead; if
  // both clocks are empty, all times are 0.
  std::function<uint64_t()> work_clock;
  // Makes queries test every value instead of searching the index structures, vector kernels and tables. Used to verify
  // them: the results must be the same, and only the cost may differ.
  bool brute_force = false;
};

// Cost of queries, summed over all threads. The cost is not part of the result.
struct QueryCost {
  Work work;
  uint64_t nanoseconds = 0;  // measured by RunOptions::work_clock
};

class BatchRun {
 public:
  // Limit of the number of begun chunks: chunks that run, and chunks that are done but wait until an earlier chunk is
  // written out. A chunk of further queries is started only if there are fewer than kMaxChunks begun chunks. A chunk
  // that split() made is started only if there are fewer than 2 * kMaxChunks begun chunks, or if the chunk is the first
  // one in batch order.
  static constexpr size_t kMaxChunks = 16;

  // Prepares the execution of `batch`, which has passed check_batch(): resolves the as_of times of its queries and
  // allocates dense rows in `answer`. Borrows `snapshot`, `batch` and `answer`. Returns OUT_OF_RANGE for a time outside
  // the history unless the block of the query has OutsideHistory::kClamp.
  static absl::StatusOr<std::unique_ptr<BatchRun>> prepare(const SceneSnapshot& snapshot, const QueryBatch& batch,
                                                           RunOptions options, AnswerSink& answer);

  // Returns an upper bound of the memory of the instances that the queries interpolate between ticks. None of it is
  // allocated before work().
  uint64_t interpolated_bytes() const { return interpolated_bytes_; }

  // Runs chunks until about `nanoseconds` have passed or no chunk may be started. Writes finished chunks to the
  // AnswerSink in batch order, up to the first chunk that is not finished.
  Progress work(uint64_t nanoseconds) LOCUS_EXCLUDES(mutex_);

  // Returns OK, or the status with which RunOptions::stop ended the batch. The caller must discard `answer` if the
  // status is not OK. Valid once work() has returned kDone.
  absl::Status status() const { return control_.stopped() ? control_.status() : absl::OkStatus(); }
  // Return the cost of the block with the index `block`, and the cost of the whole batch. Valid once work() has
  // returned kDone.
  const QueryCost& cost(size_t block) const {
    LOCUS_DCHECK_LT(block, blocks_.size());
    return blocks_[block].cost;
  }
  QueryCost cost() const;
  // Returns the number of nodes, cells and tests of all chunks that ran, including chunks that are missing from the
  // answer because the batch was stopped.
  uint64_t work_done() const { return work_done_.load(std::memory_order_relaxed); }

 private:
  struct Block {
    Block(const QueryBlock& block, QueryTimes&& resolved, size_t count, size_t max_chunk)
        : times(std::move(resolved)), origins(block, times), queries(count), max_chunk_queries(max_chunk) {}

    const QueryTimes times;
    const QueryOrigins origins;
    const size_t queries;
    const size_t max_chunk_queries;
    BlockOutput output;
    QueryCost cost;  // `work` counts only the chunks written out, `nanoseconds` counts all chunks
  };
  // Consecutive queries of one block: [begin, end).
  struct Chunk {
    size_t block;
    size_t begin, end;
    bool done = false;
    CollectedRows rows = {};  // counts and rows of a kCounted block; truncated queries of any block
    Work work = {};
  };
  using Chunks = std::list<Chunk>;
  // Interval in which one thread works on one block without interruption; `start` is in nanoseconds of work_time().
  struct TimingSpan {
    size_t block;
    uint64_t start;
  };

  BatchRun(const SceneSnapshot& snapshot, const QueryBatch& batch, RunOptions options, AnswerSink& answer);
  void add_block(QueryTimes times);

  // Checks the invariants of the class comment; O(number of chunks).
  void check_invariants() const LOCUS_REQUIRES(mutex_);
  // Checks that query `begin` of block `block` directly follows query `end` - 1 of block `before` in batch order.
  void check_adjacent(size_t before, size_t end, size_t block, size_t begin) const;

  // Returns whether a chunk may be started now.
  bool can_begin() const LOCUS_REQUIRES(mutex_);
  // Starts the first unstarted chunk, or, if there is none, a new chunk of the next queries that are in no chunk.
  // Precondition: can_begin().
  Chunks::iterator begin_chunk() LOCUS_REQUIRES(mutex_);
  Chunks::iterator pop_unstarted() LOCUS_REQUIRES(mutex_);
  // Moves the queries of `chunk` from `reached` on into two new, unstarted chunks directly after `chunk`. Each new
  // chunk gets half of these queries; a single query needs only one new chunk. If there were only one new chunk each
  // time, only one thread at a time could work on a block of few, expensive queries.
  void split(Chunks::iterator chunk, size_t reached) LOCUS_REQUIRES(mutex_);
  // Adds an unstarted chunk of the queries [begin, end) of the block of `before`, directly after `before`.
  void insert_unstarted(Chunks::iterator before, size_t begin, size_t end) LOCUS_REQUIRES(mutex_);
  void skip_empty_blocks() LOCUS_REQUIRES(mutex_);
  // Answers the queries of `chunk` in order, and stops early if the queries turn out to be expensive. Returns the index
  // of the first query that is not answered.
  size_t run(Chunk& chunk);
  // Marks `chunk` as done and moves its queries from `reached` on, which are not answered, into new chunks. Then calls
  // write_out() if the first chunk of chunks_ is done and no other thread is in write_out().
  void end_chunk(Chunks::iterator chunk, size_t reached) LOCUS_EXCLUDES(mutex_);
  // Removes chunks from the front of chunks_ and writes them to the AnswerSink, up to the first chunk that is not done.
  void write_out() LOCUS_EXCLUDES(mutex_);
  void write(const Chunk& chunk);
  void write_counted(const Chunk& chunk);
  void write_counts(const Chunk& chunk);
  // Returns the progress that work() reports to its caller. Returns kDone only once.
  Progress progress() LOCUS_REQUIRES(mutex_);
  uint64_t now() const { return options_.clock ? options_.clock() : 0; }
  TimingSpan begin_timing(size_t block) const { return {block, work_time()}; }
  void end_timing(const TimingSpan& timing) LOCUS_REQUIRES(mutex_) {
    const uint64_t end = work_time();
    LOCUS_DCHECK_GE(end, timing.start);
    blocks_[timing.block].cost.nanoseconds += end - timing.start;
  }
  uint64_t work_time() const { return options_.work_clock ? options_.work_clock() : now(); }

  const SceneSnapshot& snapshot_;
  const QueryBatch& batch_;
  const RunOptions options_;
  AnswerSink& answer_;
  BatchControl control_;
  std::deque<Block> blocks_;
  std::atomic<uint64_t> work_done_{0};
  uint64_t interpolated_bytes_ = 0;
  std::atomic<uint64_t> free_bytes_;  // reply bytes left for counted rows; set by write_out()

  Mutex mutex_;
  Chunks chunks_ LOCUS_GUARDED_BY(mutex_);                            // in batch order; write_out() removes chunks
  std::vector<Chunks::iterator> unstarted_ LOCUS_GUARDED_BY(mutex_);  // unstarted elements of chunks_, in batch order
  size_t next_block_ LOCUS_GUARDED_BY(mutex_) = 0;                    // block of the first query that is in no chunk
  size_t next_query_ LOCUS_GUARDED_BY(mutex_) = 0;        // index in its block of the first query that is in no chunk
  uint32_t active_threads_ LOCUS_GUARDED_BY(mutex_) = 0;  // number of threads that run a chunk or write_out()
  bool writing_ LOCUS_GUARDED_BY(mutex_) = false;         // a thread is in write_out()
  bool done_ LOCUS_GUARDED_BY(mutex_) = false;            // kDone was returned
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_BATCH_RUN_H_
