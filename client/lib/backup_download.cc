#include <algorithm>
#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "client/lib/status.h"
#include "client/lib/transfers.h"
#include "core/base/status_macros.h"
#include "grpcpp/client_context.h"

namespace locus::client {
namespace {

absl::Status damaged(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("the backup came damaged: ", what, "; back up again"));
}

absl::Status damaged_file(absl::string_view path, absl::string_view what) {
  return damaged(absl::StrCat("its file \"", absl::CEscape(path), "\" ", what));
}

bool equal(const Sha256& hash, absl::string_view bytes) {
  return std::equal(hash.begin(), hash.end(), bytes.begin(), bytes.end(),
                    [](uint8_t a, char b) { return a == static_cast<uint8_t>(b); });
}

// Receiver of the messages of one backup. Passes the files to the sink, and verifies each file's path, size and hash,
// and the announced number of files and bytes.
class BackupReceiver {
 public:
  explicit BackupReceiver(BackupSink& sink) : sink_(sink) {}

  absl::Status receive(const v1::BackupResponse& message) {
    if (message.has_announced() != first_) return damaged("the announcement is not exactly in the first message");
    if (first_) return begin(message);
    if (!message.path().empty()) {
      RETURN_IF_ERROR(begin_file(message.path()));
    }
    if (!in_file_) return damaged("bytes came that belong to no file");
    RETURN_IF_ERROR(add(message.data()));
    return message.has_end() ? end_file(message.end()) : absl::OkStatus();
  }

  absl::StatusOr<BackupSize> finish() const {
    if (first_) return damaged("nothing came");
    if (in_file_) return damaged_file(file_.path, "has no end");
    if (received_.files != announced_.files || received_.bytes != announced_.bytes)
      return damaged("less came than was announced");
    return received_;
  }

 private:
  absl::Status begin(const v1::BackupResponse& message) {
    if (!message.path().empty() || !message.data().empty() || message.has_end())
      return damaged("its first message contains more than the announcement");
    first_ = false;
    announced_ = {message.announced().files(), message.announced().bytes()};
    if (announced_.files > kMaxBackupFiles)
      return damaged(absl::StrCat(announced_.files, " files are announced, at most ", kMaxBackupFiles, " may be"));
    return sink_.begin(announced_);
  }

  absl::Status begin_file(const std::string& path) {
    if (in_file_) return damaged_file(file_.path, "has no end");
    if (received_.files == announced_.files) return damaged("more came than was announced");
    if (absl::Status fit = paths_.add(path); !fit.ok()) return damaged_file(path, fit.message());
    in_file_ = true;
    file_ = {.path = path};
    return sink_.begin_file(path);
  }

  absl::Status add(const std::string& data) {
    if (data.empty()) return absl::OkStatus();
    if (data.size() > announced_.bytes - received_.bytes) return damaged("more came than was announced");
    received_.bytes += data.size();
    file_.bytes += data.size();
    hasher_.add(data);
    return sink_.add(data);
  }

  absl::Status end_file(const v1::BackupFileEnd& end) {
    in_file_ = false;
    ++received_.files;
    file_.sha256 = hasher_.finish();
    if (file_.bytes != end.bytes()) return damaged_file(file_.path, "has another size than the server says");
    if (!equal(file_.sha256, end.sha256())) return damaged_file(file_.path, "has another SHA-256 than the server says");
    return sink_.end_file(file_);
  }

  BackupSink& sink_;
  bool first_ = true;
  bool in_file_ = false;
  BackupSize announced_;
  BackupSize received_;  // complete files, and bytes of all files including the current one
  BackupPaths paths_;
  BackupFile file_;
  Sha256Hasher hasher_;
};

}  // namespace

absl::StatusOr<BackupSize> download_backup(v1::ServerService::StubInterface& stub, BackupSink& sink,
                                           const CallHeader& header) {
  CancellableContext context(header.running);
  prepare(context, header);
  const auto reader = stub.Backup(&context, v1::BackupRequest());
  BackupReceiver receiver(sink);
  v1::BackupResponse message;
  absl::Status received;
  while (received.ok() && reader->Read(&message)) received = receiver.receive(message);
  if (!received.ok()) context.TryCancel();
  const absl::Status end = to_absl_status(reader->Finish());
  RETURN_IF_ERROR(received);
  RETURN_IF_ERROR(end);
  return receiver.finish();
}

}  // namespace locus::client
