#include "client/cli/backup/backup_writer.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::cli {

BackupWriter::BackupWriter(PartialDirectory& directory, BackupProgress progress)
    : directory_(directory), progress_(std::move(progress)) {}

absl::Status BackupWriter::begin(const client::BackupSize& announced) {
  announced_ = announced;
  return directory_.make(announced.bytes);
}

absl::Status BackupWriter::begin_file(const std::string& path) {
  if (path == kChecksumFile)
    return absl::DataLossError(
        absl::StrCat("the server sent a file ", path, ", a name that the backup itself uses; is this a locus server?"));
  return directory_.open_file(path);
}

absl::Status BackupWriter::add(absl::string_view bytes) {
  received_ += bytes.size();
  if (progress_) progress_(received_, announced_.bytes);
  return directory_.write(bytes);
}

absl::Status BackupWriter::end_file(const client::BackupFile& file) {
  checksums_.push_back({file.path, file.sha256});
  return directory_.close_file();
}

absl::Status BackupWriter::finish() {
  RETURN_IF_ERROR(directory_.open_file(kChecksumFile));
  RETURN_IF_ERROR(directory_.write(checksum_text(checksums_)));
  RETURN_IF_ERROR(directory_.close_file());
  return directory_.keep();
}

}  // namespace locus::cli
