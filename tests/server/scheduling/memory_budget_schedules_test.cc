// Tests random schedules of work against a model of the process's memory. The work is uploads and builds, moves with
// history and pinned revisions, dumps, backups, and replies that callers read slowly or not at all. The memory
// must never exceed the limit, and no work that fits may wait for ever.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "server/scheduling/memory_budget.h"
#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

constexpr uint64_t kLimit = uint64_t{1} << 30;
constexpr uint64_t kBase = kLimit / 32;  // memory of a process without scenes

// One piece of work: it claims memory, allocates up to its claim step by step, and leaves a part of the memory
// allocated when it ends.
struct ModelWork {
  MemoryLine line;
  MemoryBudget::Claim claim;
  uint64_t allocated = 0;
  uint64_t kept = 0;
  int stalled = 0;  // number of steps in which the work cannot end, because its caller does not read the answer
};

constexpr bool keeps_memory(MemoryLine line) {
  return line == MemoryLine::kBuilds || line == MemoryLine::kInserts || line == MemoryLine::kMoves;
}
// Returns whether work on the memory line ends only when its caller has read the data that was sent.
constexpr bool has_readers(MemoryLine line) {
  return line == MemoryLine::kDumps || line == MemoryLine::kBackups || line == MemoryLine::kReplies;
}

// Model of a process. The memory of built meshes and inserts stays until they are deleted. Moves add to the history,
// which the keeper may trim, and to pinned revisions, whose readers the keeper may revoke. All other work frees its
// memory when it ends.
class ModelProcess {
 public:
  explicit ModelProcess(uint64_t seed) : random_(seed), budget_(kLimit, [this] { return used(); }) {}

  ~ModelProcess() { works_.clear(); }

  uint64_t used() const {
    uint64_t sum = kBase + kept_ + history_ + pinned_ + free_heap_;
    for (const ModelWork& work : works_) sum += work.allocated;
    return sum;
  }

  void step() {
    switch (random_.below(8)) {
      case 0:
      case 1:
      case 2:
        return start_any();
      case 3:
      case 4:
        return allocate();
      case 5:
      case 6:
        return end_one();
      default:
        if (random_.below(4) == 0) kept_ -= random_.below(kept_ + 1);      // scenes and meshes are deleted
        if (random_.below(4) == 0) pinned_ -= random_.below(pinned_ + 1);  // readers end
        return keep();
    }
  }

  // Ends all work, without deleting any scene or mesh. Returns whether new work on each memory line then gets the
  // memory that is left for this line.
  bool everybody_gets_memory() {
    for (ModelWork& work : works_) work.stalled = 0;  // stalled calls are cancelled after a minute
    while (!works_.empty()) end_one();
    keep();
    for (size_t i = 0; i < kMemoryLines; ++i) {
      const auto line = static_cast<MemoryLine>(i);
      const uint64_t free = budget_.ceiling(line) - std::min(budget_.ceiling(line), used() - free_heap_);
      if (free > 0 && !budget_.claim(line, "", free).ok()) {
        keep();  // the caller tries again after the delay in the refusal
        if (!budget_.claim(line, "", free).ok()) return false;
      }
      budget_.refresh();
    }
    return true;
  }

  // Frees memory, trims the history and revokes readers as MemoryKeeper does.
  void keep() {
    if (budget_.take_shortage()) free_heap_ = 0;
    budget_.refresh();
    const uint64_t enough = kLimit / 4 * 3;
    if (budget_.taken() > enough) {
      history_ -= std::min(history_, budget_.taken() - enough);
      pinned_ = std::min(pinned_, kLimit / 4);
    }
    budget_.refresh();
  }

  uint64_t claimed() const {
    uint64_t sum = 0;
    for (size_t i = 0; i < kMemoryLines; ++i) sum += budget_.claimed(static_cast<MemoryLine>(i));
    return sum;
  }
  uint64_t refused(MemoryLine line) const { return budget_.refused(line); }
  uint64_t started(MemoryLine line) const { return started_[static_cast<size_t>(line)]; }

 private:
  uint64_t some_bytes() { return 1 + random_.below(uint64_t{1} << (4 + random_.below(26))); }

  // Starts work on a random memory line. An upload claims memory for its columns and for its build at the same time, as
  // in the server, and is not started if one of the claims is refused.
  void start_any() {
    const auto line = static_cast<MemoryLine>(random_.below(kMemoryLines));
    const uint64_t bytes = some_bytes();
    if (line != MemoryLine::kUploads) {
      start(line, bytes);
      return;
    }
    if (start(MemoryLine::kUploads, bytes) && !start(MemoryLine::kBuilds, bytes * 2)) works_.pop_back();
  }
  bool start(MemoryLine line, uint64_t bytes) {
    absl::StatusOr<MemoryBudget::Claim> claim = budget_.claim(line, "", bytes);
    if (!claim.ok()) return false;
    ++started_[static_cast<size_t>(line)];
    ModelWork work{line, *std::move(claim)};
    work.kept = keeps_memory(line) ? random_.below(bytes + 1) : 0;
    work.stalled = has_readers(line) && random_.below(4) == 0 ? static_cast<int>(random_.below(200)) : 0;
    works_.push_back(std::move(work));
    return true;
  }
  void allocate() {
    for (ModelWork& work : works_) work.allocated += random_.below(work.claim.bytes() - work.allocated + 1);
  }
  void end_one() {
    if (works_.empty()) return;
    std::swap(works_[random_.below(works_.size())], works_.back());
    ModelWork& work = works_.back();
    if (work.stalled > 0) {
      --work.stalled;
      return;
    }
    work.allocated = std::max(work.allocated, work.kept);
    const uint64_t left = work.allocated - work.kept;
    // The allocator keeps a random part of the freed memory, and releases the memory that it kept before.
    free_heap_ = random_.below(left + 1);
    if (work.line == MemoryLine::kMoves) {
      const uint64_t pinned = random_.below(work.kept + 1);
      pinned_ += pinned;
      history_ += work.kept - pinned;
    } else {
      kept_ += work.kept;
    }
    works_.pop_back();
  }

  test::Random random_;
  uint64_t kept_ = 0;
  uint64_t history_ = 0;
  uint64_t pinned_ = 0;
  uint64_t free_heap_ = 0;
  std::array<uint64_t, kMemoryLines> started_{};
  std::vector<ModelWork> works_;  // declared before budget_, which measures them from its construction on
  MemoryBudget budget_;
};

TEST(MemoryBudgetSchedulesTest, MemoryStaysBelowTheLimitAndNobodyWaitsForEver) {
  const uint64_t schedules = test::scaled_count(10'000);
  uint64_t highest = 0;
  std::array<uint64_t, kMemoryLines> started{}, refused{};
  for (uint64_t seed = 1; seed <= schedules; ++seed) {
    ModelProcess process(seed);
    for (int step = 0; step < 200; ++step) {
      process.step();
      highest = std::max(highest, process.used());
      ASSERT_LE(process.used(), kLimit) << "seed " << seed << ", step " << step;
      ASSERT_LE(process.claimed(), kLimit) << "seed " << seed << ", step " << step;
    }
    for (size_t i = 0; i < kMemoryLines; ++i) {
      started[i] += process.started(static_cast<MemoryLine>(i));
      refused[i] += process.refused(static_cast<MemoryLine>(i));
    }
    ASSERT_TRUE(process.everybody_gets_memory()) << "seed " << seed;
  }
  EXPECT_GT(highest, kLimit / 8 * 7);  // memory was nearly full
  for (size_t i = 0; i < kMemoryLines; ++i) {
    EXPECT_GT(started[i], schedules) << memory_line_name(static_cast<MemoryLine>(i));
    EXPECT_GT(refused[i], schedules / 100) << memory_line_name(static_cast<MemoryLine>(i));
  }
}

}  // namespace
}  // namespace locus::server
