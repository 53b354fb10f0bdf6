// A checked batch being answered against one snapshot, in pieces that any threads take. The answer is a function of
// snapshot and batch alone: who takes which piece, how large it is and in what order they end changes no byte of it (a
// batch cut by max_work apart).
//
// Threads: work() may be called by any number of threads at once; everything else before the first or after the last
// call. Memory: rows wait for their turn in at most kMaxChunks pieces, each of at most a reply.
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
#include "core/base/mutex.h"
#include "core/query/kinds/query_task.h"
#include "core/query/kinds/query_times.h"
#include "core/query/query_batch.h"
#include "core/query/run/answer_sink.h"
#include "core/query/run/block_runner.h"
#include "core/query/run/progress.h"
#include "core/scene/snapshot/scene_snapshot.h"

namespace locus {

struct RunOptions {
  // Of run_batch() alone: calls its second argument for each number below the first, on any threads, and returns when
  // all calls have. [in order, on this thread]
  std::function<void(size_t, const std::function<void(size_t)>&)> parallel_for;
  // Asked every limits::kTestsBetweenChecks primitive tests, from any thread: a status that is not OK ends the batch
  // with it. [never ends]
  std::function<absl::Status()> stop;
  // Nanoseconds since some moment, asked before and after each piece of work, from any thread. [work() takes one piece]
  std::function<uint64_t()> clock;
  // What the calling thread has worked in its life; may be dear, as it is asked about twice a call of work() and a
  // block. [clock; without that, times are 0]
  std::function<uint64_t()> work_clock;
  // Test every value instead of asking the structures: for checking them. Same answers, different work.
  bool brute_force = false;
};

// What queries took, by all threads together. No part of the answer.
struct QueryCost {
  Work work;
  uint64_t nanoseconds = 0;  // by RunOptions::work_clock
};

class BatchRun {
 public:
  // Pieces that wait for those before them, or are in work.
  static constexpr size_t kMaxChunks = 16;

  // `snapshot`, `batch` and `answer` are borrowed; `batch` has passed check_batch(). OUT_OF_RANGE for a time that is
  // not kept, unless its block clamps.
  static absl::StatusOr<std::unique_ptr<BatchRun>> prepare(const SceneSnapshot& snapshot, const QueryBatch& batch,
                                                           RunOptions options, AnswerSink& answer);

  // Takes pieces until about so much time has passed or none can be begun.
  Progress work(uint64_t nanoseconds) LOCUS_EXCLUDES(mutex_);

  // Once work() has returned kDone: OK, or what RunOptions::stop said, and then `answer` is void.
  absl::Status status() const { return control_.stopped() ? control_.status() : absl::OkStatus(); }
  const QueryCost& cost(size_t block) const { return blocks_[block].cost; }
  QueryCost cost() const;

 private:
  struct Block {
    Block(QueryTimes&& when, size_t count, size_t most) : moments(std::move(when)), queries(count), step(most) {}

    const QueryTimes moments;
    const size_t queries;
    const size_t step;  // queries of a piece, at most
    BlockPlace place;
    QueryCost cost;  // its work as far as it is written out
  };
  // Some queries of a block, in a row.
  struct Chunk {
    size_t block;
    size_t begin, end;
    bool done = false;
    BlockResult rows = {};  // of blocks that count them
    Work work = {};
  };
  using Chunks = std::list<Chunk>;
  // What one thread does for one block without a break.
  struct TimingSpan {
    size_t block;
    uint64_t start;
  };

  BatchRun(const SceneSnapshot& snapshot, const QueryBatch& batch, RunOptions options, AnswerSink& answer);
  void add_block(QueryTimes moments);

  bool can_begin() const LOCUS_REQUIRES(mutex_);
  Chunks::iterator begin_chunk() LOCUS_REQUIRES(mutex_);
  Chunks::iterator pop_left() LOCUS_REQUIRES(mutex_);
  void leave(Chunks::iterator chunk, size_t reached) LOCUS_REQUIRES(mutex_);
  void pass_empty_blocks() LOCUS_REQUIRES(mutex_);
  // Answers the piece, or as much of it as makes a piece; returns the first query that is left.
  size_t run(Chunk& chunk);
  void end_chunk(Chunks::iterator chunk, size_t reached) LOCUS_EXCLUDES(mutex_);
  // Hands on what is done up to the first piece that is not.
  void write_out() LOCUS_EXCLUDES(mutex_);
  void write(const Chunk& chunk);
  void write_counted(const Chunk& chunk);
  Progress progress() LOCUS_REQUIRES(mutex_);
  uint64_t now() const { return options_.clock ? options_.clock() : 0; }
  TimingSpan begin_timing(size_t block) const { return {block, worked()}; }
  void end_timing(const TimingSpan& timing) LOCUS_REQUIRES(mutex_) {
    blocks_[timing.block].cost.nanoseconds += worked() - timing.start;
  }
  uint64_t worked() const { return options_.work_clock ? options_.work_clock() : now(); }

  const SceneSnapshot& snapshot_;
  const QueryBatch& batch_;
  const RunOptions options_;
  AnswerSink& answer_;
  BatchControl control_;
  std::deque<Block> blocks_;
  std::atomic<uint64_t> room_;  // bytes of counted rows that still fit; written by whoever writes out

  Mutex mutex_;
  Chunks chunks_ LOCUS_GUARDED_BY(mutex_);                       // in order, from the first that is not handed on
  std::vector<Chunks::iterator> left_ LOCUS_GUARDED_BY(mutex_);  // of them, in order, those that nobody has begun
  size_t next_block_ LOCUS_GUARDED_BY(mutex_) = 0;               // the first query that is in no piece
  size_t next_query_ LOCUS_GUARDED_BY(mutex_) = 0;
  uint32_t at_work_ LOCUS_GUARDED_BY(mutex_) = 0;  // threads
  bool writing_ LOCUS_GUARDED_BY(mutex_) = false;
  bool done_ LOCUS_GUARDED_BY(mutex_) = false;  // and somebody was told
};

}  // namespace locus

#endif  // LOCUS_CORE_QUERY_RUN_BATCH_RUN_H_
