#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/cli/backup/read_backup.h"
#include "client/cli/commands.h"
#include "client/cli/output.h"
#include "client/cli/progress.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct RestoreOptions {
  std::string backup;
  std::string data_dir;
  bool verify_only = false;
};

// Reads the backup, and copies it to `copy` unless that is null. Shows the progress as `action`.
absl::StatusOr<client::BackupSize> read_with_progress(const std::string& backup, PartialDirectory* copy,
                                                      const std::string& action, ProgressWriter& progress) {
  progress.begin({.action = action, .subject = backup, .unit = kProgressBytes});
  return read_backup(backup, copy, [&](uint64_t done, uint64_t total) { progress.update(done, total); });
}

absl::Status verify(const RestoreOptions& options, Context& context) {
  ProgressWriter progress = start_progress(context);
  ASSIGN_OR_RETURN(const client::BackupSize size, read_with_progress(options.backup, nullptr, "verifying", progress));
  progress.hide();
  Report report;
  report.head = {{"backup", options.backup}, {"files", size.files}, {"bytes", size.bytes}, {"whole", true}};
  context.acknowledge(report,
                      absl::StrCat(options.backup, " is whole: ", size.files, " files, ", size.bytes, " bytes"));
  return absl::OkStatus();
}

absl::Status restore(const RestoreOptions& options, Context& context) {
  if (options.verify_only && !options.data_dir.empty())
    return usage_error("--verify-only restores nothing: leave DATA_DIR out");
  if (options.verify_only) return verify(options, context);
  if (options.data_dir.empty()) return usage_error("give the DATA_DIR to restore into, or --verify-only");
  PartialDirectory copy(options.data_dir, TargetRule::kNothingOrEmpty);
  RETURN_IF_ERROR(copy.check());
  ProgressWriter progress = start_progress(context);
  ASSIGN_OR_RETURN(const client::BackupSize size, read_with_progress(options.backup, &copy, "restoring", progress));
  progress.begin({.action = "syncing", .subject = copy.target()});
  RETURN_IF_ERROR(copy.keep());
  progress.hide();
  Report report;
  report.head = {{"data_dir", copy.target()}, {"files", size.files}, {"bytes", size.bytes}};
  context.acknowledge(report, absl::StrCat(copy.target(), ": ", size.files, " files, ", size.bytes, " bytes"));
  if (context.options().quiet) return absl::OkStatus();
  context.err() << "next: `locusd check " << copy.target() << "`, then `locusd --data-dir " << copy.target()
                << "`; where the daemon runs as another user, give it the directory first (chown -R)\n";
  return absl::OkStatus();
}

}  // namespace

void add_restore_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<RestoreOptions>();
  CLI::App& command =
      *parent.add_subcommand("restore", "Make a data directory for locusd from a backup; needs no server");
  command.footer(R"(Examples:
  locus restore arena-backup new-data
  locusd check new-data && locusd --data-dir new-data
  locus restore arena-backup --verify-only

Every file is proven by SHA256SUMS. DATA_DIR must be new or empty, and appears once everything in it is on the disk.)");
  command.add_option("BACKUP", options->backup, "A directory that `locus backup` made")->required();
  command.add_option("DATA_DIR", options->data_dir, "The data directory to make");
  command.add_flag("--verify-only", options->verify_only, "Only verify that the backup is complete");
  run_when_chosen(command, options, context, restore);
}

}  // namespace locus::cli
