#include "core/base/progress_writer.h"

#include <utility>

namespace locus {

ProgressWriter::ProgressWriter(ProgressOptions options)
    : options_(std::move(options)), line_(options_.style, options_.columns) {}

ProgressWriter::~ProgressWriter() {
  hide();
  {
    const MutexLock lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void ProgressWriter::begin(ProgressPhase phase) {
  if (options_.style == ProgressStyle::kSilent) return;
  const MutexLock lock(mutex_);
  write(line_.begin(std::move(phase), seconds()));
  if (!thread_.joinable()) thread_ = std::thread([this] { redraw_until_end(); });
  changed_.notify_all();
}

void ProgressWriter::update(uint64_t done, uint64_t total) {
  if (options_.style == ProgressStyle::kSilent) return;
  const MutexLock lock(mutex_);
  if (total > 0) line_.set_total(total);
  write(line_.update(done, -1, seconds()));
}

void ProgressWriter::update_share(uint64_t done, double share) {
  if (options_.style == ProgressStyle::kSilent) return;
  const MutexLock lock(mutex_);
  write(line_.update(done, share, seconds()));
}

void ProgressWriter::hide() {
  if (options_.style == ProgressStyle::kSilent) return;
  const MutexLock lock(mutex_);
  write(line_.hide());
}

void ProgressWriter::show() {
  if (options_.style == ProgressStyle::kSilent) return;
  const MutexLock lock(mutex_);
  write(line_.show(seconds()));
  changed_.notify_all();
}

double ProgressWriter::seconds() const {
  return std::chrono::duration<double>(options_.now().time_since_epoch()).count();
}

void ProgressWriter::write(const std::string& text) {
  if (!text.empty()) options_.write(text);
}

void ProgressWriter::redraw_until_end() {
  const MutexLock lock(mutex_);
  while (!ended_) {
    if (!line_.active()) {
      changed_.wait(mutex_);
      continue;
    }
    const double wait = line_.due() - seconds();
    if (wait > 0) {
      changed_.wait_until(mutex_, options_.now() + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                                       std::chrono::duration<double>(wait)));
    }
    write(line_.poll(seconds()));
  }
}

}  // namespace locus
