#include "server/host/memory_keeper.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/check.h"
#include "server/host/memory_lines.h"
#include "server/observability/log.h"
#include "server/scheduling/allocator_use.h"
#include "server/scheduling/clocks.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kInterval{50};
// Minimum interval between two releases of free memory while memory is short or claims are refused. It is long, because
// a release visits the whole heap.
constexpr milliseconds kReleaseInterval{1000};
// Interval over which the load of the process is measured. The process is busy if it uses more than 1 / kBusyShare of
// the time of one processor.
constexpr milliseconds kLoadInterval{1000};
constexpr int kBusyShare = 5;
// Minimum intervals between two checks for free memory while memory is not short, for a process that is idle and one
// that is busy. A check also waits kCheckShare times as long as the last check took.
constexpr milliseconds kIdleCheckInterval{1000};
constexpr milliseconds kBusyCheckInterval{30'000};
constexpr int kCheckShare = 100;
// Minimum interval between two checks of the readers of all scenes while memory is short. A check may visit much of the
// data that the readers hold.
constexpr milliseconds kReadersInterval{1000};
// Minimum interval between two log entries about refused claims.
constexpr milliseconds kRefusalsInterval{5000};
// Interval between two checks for histories that forget ticks early.
constexpr milliseconds kNoticesInterval{1000};
// Minimum interval between two log entries about the use of each line of the memory budget.
constexpr milliseconds kLinesInterval{60'000};

std::vector<ScenePtr> all_scenes(const Registry& registry) {
  return registry.list_scenes("", std::numeric_limits<size_t>::max());
}

uint64_t history_bytes(const Scene& scene) {
  const SnapshotPtr snapshot = scene.latest();
  return snapshot->history == nullptr ? 0 : snapshot->history->bytes;
}

}  // namespace

std::vector<uint64_t> shrunk_sizes(const std::vector<uint64_t>& sizes, uint64_t excess) {
  const uint64_t sum = std::accumulate(sizes.begin(), sizes.end(), uint64_t{0});
  const double kept = sum <= excess ? 0.0 : static_cast<double>(sum - excess) / static_cast<double>(sum);
  std::vector<uint64_t> shrunk;
  shrunk.reserve(sizes.size());
  for (const uint64_t size : sizes) shrunk.push_back(static_cast<uint64_t>(static_cast<double>(size) * kept));
  return shrunk;
}

MemoryKeeper::MemoryKeeper(MemoryBudget& budget, Registry& registry, Shed shed, const UpdateLog* log)
    : budget_(budget), registry_(registry), shed_(std::move(shed)), log_(log) {
  thread_ = std::thread([this] { run(); });
}

MemoryKeeper::~MemoryKeeper() {
  {
    const MutexLock lock(mutex_);
    ended_ = true;
    ended_changed_.notify_all();
  }
  thread_.join();
}

void MemoryKeeper::run() {
  while (true) {
    {
      const MutexLock lock(mutex_);
      const steady_clock::time_point next = steady_clock::now() + kInterval;
      while (!ended_ && ended_changed_.wait_until(mutex_, next)) {
      }
      if (ended_) return;
    }
    keep();
  }
}

void MemoryKeeper::keep() {
  budget_.refresh();
  const uint64_t enough = short_memory(budget_.limit());
  const bool is_short = budget_.taken() > enough;
  if (is_short) shed_connections();
  const steady_clock::time_point now = steady_clock::now();
  refused_ = budget_.take_shortage() || refused_;
  const bool is_needed = is_short || refused_;
  if (is_needed && now - last_release_ >= kReleaseInterval) {
    last_release_ = now;
    refused_ = false;
    release_needed();
  }
  release_spare(now);
  if (const uint64_t taken = budget_.taken(); taken > enough) trim_histories(taken - enough);
  if (is_short && now - last_readers_ >= kReadersInterval) {
    last_readers_ = now;
    revoke_readers();
  }
  log_refusals(now);
  if (is_needed) log_lines(now);
  if (now - last_notices_ >= kNoticesInterval) {
    last_notices_ = now;
    history_notices_.check(all_scenes(registry_), now);
  }
}

// If the measured memory exceeds the ceiling of moves, closes the connections that claim and send most bytes; otherwise
// only measures the bytes that they send. When memory comes near this ceiling, inserts and uploads are already refused
// and histories already shortened. So the memory that still grows is allocated by gRPC and claimed by no call, for
// example for calls that are cancelled immediately, or for endless headers.
void MemoryKeeper::shed_connections() {
  const bool is_full = budget_.measured() > budget_.ceiling(MemoryLine::kMoves);
  const size_t closed = shed_(is_full);
  if (closed == 0) return;
  log(LogLevel::kWarning, "memory is nearly full: the connections that hold or send most were closed",
      {{"connections", absl::StrCat(closed)}, {"memory_bytes", absl::StrCat(budget_.measured())}});
}

void MemoryKeeper::release_needed() {
  for (const ScenePtr& scene : all_scenes(registry_)) scene->forget_recent();
  return_free_memory();
  budget_.refresh();
}

void MemoryKeeper::release_spare(steady_clock::time_point now) {
  if (now - last_load_ < kLoadInterval) return;
  const std::chrono::nanoseconds cpu(process_nanoseconds());
  const bool is_busy = (cpu - std::exchange(cpu_at_load_, cpu)) * kBusyShare > now - std::exchange(last_load_, now);
  if (now < next_check_ || (is_busy && now - last_check_ < kBusyCheckInterval)) return;
  last_check_ = now;
  const AllocatorUse use = allocator_use(budget_.measured());
  unreturned_ = std::min(unreturned_, use.reusable);
  if (use.reusable - unreturned_ > spare_ceiling(budget_.limit(), use.live)) {
    return_free_memory();
    budget_.refresh();
    unreturned_ = allocator_use(budget_.measured()).reusable;
  }
  next_check_ = now + std::max<steady_clock::duration>(kIdleCheckInterval, (steady_clock::now() - now) * kCheckShare);
}

void MemoryKeeper::trim_histories(uint64_t excess) {
  std::vector<ScenePtr> scenes;
  std::vector<uint64_t> sizes;
  for (const ScenePtr& scene : all_scenes(registry_)) {
    const uint64_t bytes = history_bytes(*scene);
    if (bytes == 0) continue;
    scenes.push_back(scene);
    sizes.push_back(bytes);
  }
  if (scenes.empty()) return;
  const std::vector<uint64_t> shrunk = shrunk_sizes(sizes, excess);
  uint64_t trimmed = 0;
  for (size_t i = 0; i < scenes.size(); ++i) trimmed += scenes[i]->trim_history(shrunk[i]);
  if (trimmed == 0) return;
  trimmed_bytes_.fetch_add(trimmed);
  return_free_memory();
  budget_.refresh();
  log(LogLevel::kWarning, "memory is short: the oldest ticks of histories were dropped",
      {{"dropped_bytes", absl::StrCat(trimmed)},
       {"memory_bytes", absl::StrCat(budget_.taken())},
       {"limit", absl::StrCat(budget_.limit())},
       {"hint", "give scenes a smaller history_bytes, or the server a larger --memory-limit"}});
}

void MemoryKeeper::revoke_readers() {
  const std::vector<ScenePtr> scenes = all_scenes(registry_);
  std::vector<uint64_t> held;
  held.reserve(scenes.size());
  for (const ScenePtr& scene : scenes) held.push_back(scene->status().pinned_bytes);
  const uint64_t sum = std::accumulate(held.begin(), held.end(), uint64_t{0});
  // If inserts are refused, cancel readers of old revisions, so that inserts succeed again.
  const uint64_t growth = budget_.ceiling(MemoryLine::kInserts), taken = budget_.taken();
  const uint64_t excess = taken - std::min(taken, growth);
  const uint64_t allowed = std::min(pinned_ceiling(budget_.limit()), sum - std::min(sum, excess));
  if (sum <= allowed) return;
  const std::vector<uint64_t> shrunk = shrunk_sizes(held, sum - allowed);
  uint64_t revoked = 0;
  for (size_t i = 0; i < scenes.size(); ++i)
    if (held[i] > shrunk[i]) revoked += scenes[i]->revoke_readers(shrunk[i]);
  if (revoked == 0) return;
  revoked_bytes_.fetch_add(revoked);
  log(LogLevel::kWarning, "memory is short: the readers of the oldest revisions were cancelled",
      {{"pinned_bytes", absl::StrCat(sum)},
       {"revoked_bytes", absl::StrCat(revoked)},
       {"memory_bytes", absl::StrCat(taken)},
       {"limit", absl::StrCat(budget_.limit())},
       {"hint", "lower --pinned-limit, send smaller batches, or give the server a larger --memory-limit"}});
}

void MemoryKeeper::log_refusals(steady_clock::time_point now) {
  if (now - last_refusals_ < kRefusalsInterval) return;
  for (size_t i = 0; i < kMemoryLines; ++i) {
    const auto line = static_cast<MemoryLine>(i);
    const uint64_t refused = budget_.refused(line), before = std::exchange(logged_refusals_[i], refused);
    if (refused == before) continue;
    last_refusals_ = now;
    log(LogLevel::kWarning, "memory is full: claims were refused",
        {{"line", std::string(memory_line_name(line))},
         {"refused", absl::StrCat(refused - before)},
         {"ceiling", absl::StrCat(budget_.ceiling(line))},
         {"memory_bytes", absl::StrCat(budget_.taken())},
         {"limit", absl::StrCat(budget_.limit())},
         {"hint", "`locus limits` shows what the memory is used for"}});
  }
}

void MemoryKeeper::log_lines(steady_clock::time_point now) {
  if (last_lines_ != steady_clock::time_point() && now - last_lines_ < kLinesInterval) return;
  last_lines_ = now;
  const std::vector<MemoryLineUse> lines = memory_lines(budget_, registry_, log_);
  log(LogLevel::kWarning, "memory is short: what it is used for",
      {{"lines", absl::StrJoin(lines, " ",
                               [](std::string* out, const MemoryLineUse& line) {
                                 absl::StrAppend(out, line.name, "=", line.used);
                               })},
       {"memory_bytes", absl::StrCat(budget_.taken())},
       {"limit", absl::StrCat(budget_.limit())}});
}

}  // namespace locus::server
