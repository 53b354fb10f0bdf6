// Progress line of a backup or a restore; written only if Context::progress() is Progress::kLive.
#ifndef LOCUS_CLIENT_CLI_BACKUP_PROGRESS_LINE_H_
#define LOCUS_CLIENT_CLI_BACKUP_PROGRESS_LINE_H_

#include <ostream>
#include <string>
#include <utility>

#include "client/cli/backup/backup_writer.h"
#include "client/cli/context.h"

namespace locus::cli {

// Writer of the progress line. Borrows the context, which must outlive it. The callback from progress() borrows this
// object.
class ProgressLine {
 public:
  ProgressLine(std::string doing, Context& context) : doing_(std::move(doing)), context_(context) {}

  // Returns the callback that rewrites the line, or an empty function if Context::progress() is not Progress::kLive.
  BackupProgress progress() const {
    if (context_.progress() != Progress::kLive) return {};
    return [this](uint64_t done, uint64_t total) {
      constexpr uint64_t kMebibyte = 1u << 20;
      context_.err() << "\r\x1b[K" << doing_ << ": " << done / kMebibyte << " of " << total / kMebibyte << " MiB"
                     << std::flush;
    };
  }

  void clear() const {
    if (context_.progress() == Progress::kLive) context_.err() << "\r\x1b[K" << std::flush;
  }

 private:
  const std::string doing_;
  Context& context_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_BACKUP_PROGRESS_LINE_H_
