#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/cli/backup/backup_writer.h"
#include "client/cli/commands.h"
#include "client/cli/output.h"
#include "client/cli/progress.h"
#include "client/lib/client.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct BackupOptions {
  std::string directory;
};

absl::Status back_up(const BackupOptions& options, Context& context) {
  PartialDirectory directory(options.directory, TargetRule::kNothing);
  RETURN_IF_ERROR(directory.check());
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ProgressWriter progress = start_progress(context);
  progress.begin({.action = "backing up", .subject = directory.target(), .unit = kProgressBytes});
  BackupWriter writer(directory, [&](uint64_t done, uint64_t total) { progress.update(done, total); });
  const absl::StatusOr<client::BackupSize> size = client->backup(writer);
  RETURN_IF_ERROR(size.status());
  progress.begin({.action = "syncing", .subject = directory.target()});
  RETURN_IF_ERROR(writer.finish());
  progress.hide();
  Report report;
  report.head = {{"directory", directory.target()}, {"files", size->files}, {"bytes", size->bytes}};
  context.acknowledge(report, absl::StrCat(directory.target(), ": ", size->files, " files, ", size->bytes, " bytes"));
  return absl::OkStatus();
}

}  // namespace

void add_backup_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<BackupOptions>();
  CLI::App& command = *parent.add_subcommand(
      "backup", "Copy the server's data directory as of one moment, while the server keeps running");
  command.footer(R"(Examples:
  locus backup arena-backup
  locus -a 10.0.0.5:7575 backup backups/$(date +%F)
  cd arena-backup && sha256sum -c SHA256SUMS

The directory appears once every file of it is here, proven and on this disk; until then it is DIRECTORY.partial.
`locus restore` makes a data directory of it.)");
  command.add_option("DIRECTORY", options->directory, "The directory to make")->required();
  run_when_chosen(command, options, context, back_up);
}

}  // namespace locus::cli
