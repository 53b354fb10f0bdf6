#include "client/cli/context.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/failure.h"

namespace locus::cli {

absl::StatusOr<client::Client*> Context::connect() {
  if (lines_ == Lines::kScriptCheck) return absl::CancelledError("lines are only checked");
  if (pending_batch_) {
    return usage_error("only lines that insert, move and remove stand between begin and commit");
  }
  if (client_) return client_.get();
  client::ClientOptions options;
  if (options_.timeout_seconds) {
    const absl::Duration timeout = absl::Seconds(*options_.timeout_seconds);
    options.connect_timeout = timeout;
    options.deadline = timeout;
    options.long_deadline = timeout;
    options.backup_deadline = timeout;
  }
  absl::StatusOr<std::unique_ptr<client::Client>> client = client::Client::connect(options_.address, options);
  if (absl::IsUnavailable(client.status())) {
    return absl::UnavailableError(
        absl::StrCat("nothing answers at ", options_.address, ": start one with `locusd`, or give --address"));
  }
  if (!client.ok()) return client.status();
  client_ = *std::move(client);
  return client_.get();
}

void Context::write(const Report& report) {
  write_report(out_, options_.format, report);
  if (keeps_reports_) kept_ = std::make_shared<const Report>(report);
}

std::optional<client::Revision> Context::own(const std::string& scene) const {
  const auto found = own_.find(scene);
  if (found == own_.end()) return std::nullopt;
  return found->second;
}

}  // namespace locus::cli
