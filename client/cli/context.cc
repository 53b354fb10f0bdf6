#include "client/cli/context.h"

#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/failure.h"
#include "core/base/status_macros.h"

namespace locus::cli {

absl::StatusOr<client::Client*> Context::connect() {
  if (lines_ == Lines::kScriptCheck) return absl::CancelledError("lines are only checked");
  if (client_) return client_.get();
  ASSIGN_OR_RETURN(client_, open_connection());
  connected_ = client_.get();
  return client_.get();
}

absl::StatusOr<std::unique_ptr<client::Client>> Context::open_connection(const std::string& address) const {
  RETURN_IF_ERROR(connection_mistake_);
  client::ClientOptions options;
  options.credentials = options_.connection.credentials;
  if (options_.timeout_seconds) {
    const absl::Duration timeout = absl::Seconds(*options_.timeout_seconds);
    options.connect_timeout = timeout;
    options.deadline = timeout;
    options.long_deadline = timeout;
    options.backup_deadline = timeout;
  }
  absl::StatusOr<std::unique_ptr<client::Client>> client = client::Client::connect(address, options);
  if (absl::IsUnavailable(client.status()) && absl::StrContains(client.status().message(), "nothing answers")) {
    return absl::UnavailableError(
        absl::StrCat("nothing answers at ", address, ": start one with `locusd`, or give --address"));
  }
  return client;
}

void Context::cancel_calls() {
  if (client::Client* const client = connected_) client->cancel_calls();
}

void Context::write(const Report& report) { write_report(*out_, options_.format, report); }

void Context::acknowledge(const Report& report, const std::string& text) {
  if (options_.format != Format::kTable) return write(report);
  if (!options_.quiet) *out_ << text << '\n';
}

std::optional<client::Revision> Context::own(const std::string& scene) const {
  const auto found = own_.find(scene);
  if (found == own_.end()) return std::nullopt;
  return found->second;
}

}  // namespace locus::cli
