// Writer of the progress of long work, shared by all programs. A thread of its own redraws the line while the work
// waits, so that the line never stands still, not even during a blocking call. Reads no clock and writes to no file
// itself: both are passed in. Thread-safe.
#ifndef LOCUS_CORE_BASE_PROGRESS_WRITER_H_
#define LOCUS_CORE_BASE_PROGRESS_WRITER_H_

#include <chrono>
#include <functional>
#include <thread>

#include "absl/strings/string_view.h"
#include "core/base/mutex.h"
#include "core/base/progress_line.h"

namespace locus {

struct ProgressOptions {
  ProgressStyle style = ProgressStyle::kSilent;
  size_t columns = 80;                                         // width of the terminal
  std::function<std::chrono::steady_clock::time_point()> now;  // the monotonic clock
  std::function<void(absl::string_view)> write;                // writes to standard error, and flushes
};

class ProgressWriter {
 public:
  explicit ProgressWriter(ProgressOptions options);
  // Erases the line and ends the thread.
  ~ProgressWriter();
  ProgressWriter(const ProgressWriter&) = delete;
  ProgressWriter& operator=(const ProgressWriter&) = delete;

  // Begins a phase, and ends the phase before it. The first call starts the thread, unless the style is kSilent.
  void begin(ProgressPhase phase) LOCUS_EXCLUDES(mutex_);
  // Sets the amount that is done, and the total if it is not 0.
  void update(uint64_t done, uint64_t total = 0) LOCUS_EXCLUDES(mutex_);
  // Sets the amount and the part of the phase that is done, from 0 to 1, for a phase of unknown total; negative =
  // unknown, too.
  void update_share(uint64_t done, double share) LOCUS_EXCLUDES(mutex_);
  // Erases the line; no thread writes until show() or begin(). Call hide() before anything else is written to the
  // terminal or to the same stream.
  void hide() LOCUS_EXCLUDES(mutex_);
  void show() LOCUS_EXCLUDES(mutex_);

 private:
  double seconds() const;
  void write(const std::string& text) LOCUS_REQUIRES(mutex_);
  void redraw_until_end() LOCUS_EXCLUDES(mutex_);

  const ProgressOptions options_;
  Mutex mutex_;
  ConditionVariable changed_;
  ProgressLine line_ LOCUS_GUARDED_BY(mutex_);
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // started by the first begin()
};

}  // namespace locus

#endif  // LOCUS_CORE_BASE_PROGRESS_WRITER_H_
