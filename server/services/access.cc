#include "server/services/access.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>

#include "absl/strings/match.h"
#include "core/base/status_macros.h"
#include "server/observability/log.h"
#include "server/scheduling/clocks.h"
#include "server/security/hidden_users.h"
#include "server/services/server_events.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

// Interval at which running calls check whether their credentials have expired. At the same interval, the counts of
// updates are written to the audit log if they are old enough (AuditUpdates::tick()).
constexpr milliseconds kRecheckInterval{500};

SecurityOptions security_options(const ServerConfig& config) {
  SecurityOptions options;
  options.access_file = config.access_file;
  options.token_file = config.token_file;
  options.jwks_file = config.jwks_file;
  options.jwt_audience = config.jwt_audience;
  options.jwt_issuer = config.jwt_issuer;
  options.audit_file = config.audit_file;
  options.audit_bytes = config.audit_bytes;
  return options;
}

void log_warnings(const AccessControl& control) {
  for (const std::string& warning : control.warnings()) log(LogLevel::kWarning, warning);
}

// Warns if clients of a unix socket would share the identity `user:nobody`.
void warn_of_hidden_users(const ServerConfig& config) {
  const bool has_socket = std::any_of(config.listen.begin(), config.listen.end(),
                                      [](const std::string& address) { return absl::StartsWith(address, "unix:"); });
  if (config.access_file.empty() || !has_socket) return;
  std::ostringstream map;
  map << std::ifstream("/proc/self/uid_map").rdbuf();
  if (!hides_users(map.str())) return;
  log(LogLevel::kWarning, "users of unix sockets cannot be told apart: most are user:nobody in this user namespace",
      {{"hint", "with systemd set PrivateUsers=no, or grant to tokens instead of users"}});
}

}  // namespace

absl::StatusOr<std::unique_ptr<Access>> Access::open(const ServerConfig& config, RpcState& state) {
  ASSIGN_OR_RETURN(std::unique_ptr<AccessControl> control,
                   AccessControl::open(security_options(config), &unix_seconds));
  log_warnings(*control);
  warn_of_hidden_users(config);
  state.access = control.get();
  if (control->enabled()) state.access_loads.start(unix_seconds());
  return std::unique_ptr<Access>(new Access(state, std::move(control)));
}

Access::~Access() {
  stop();
  state_.access = nullptr;
}

void Access::start(std::function<void()> recheck_calls) {
  recheck_ = std::move(recheck_calls);
  control_->on_change([this] {
    state_.quotas.refresh();
    recheck();
  });
  if (control_->enabled()) {
    watcher_.emplace(control_->files(), [this] { return reload_watched(); });
  }
  if (control_->enabled() || control_->audit() != nullptr) clock_ = std::thread([this] { run_clock(); });
}

void Access::stop() {
  watcher_.reset();
  {
    const MutexLock lock(mutex_);
    ended_ = true;
    ended_changed_.notify_all();
  }
  if (clock_.joinable()) clock_.join();
}

void Access::reload() { report(control_->reload()); }

bool Access::reload_watched() {
  const absl::Status status = control_->reload();
  // Do not report a first reading without mistakes: open() has read and reported the same files before.
  const bool is_news = status.ok() ? read_by_watcher_ : status != last_reading_;
  read_by_watcher_ = true;
  last_reading_ = status;
  if (is_news) report(status);
  return status.ok();
}

void Access::report(const absl::Status& status) const {
  if (!control_->enabled()) return;
  report_reload(state_, state_.access_loads, "access files", status);
  if (!status.ok()) {
    log(LogLevel::kError, "access files were not reloaded, the old rules stay in force",
        {{"text", std::string(status.message())}});
    return;
  }
  log(LogLevel::kInfo, "access files were reloaded");
  log_warnings(*control_);
}

void Access::run_clock() {
  while (true) {
    {
      const MutexLock lock(mutex_);
      const steady_clock::time_point next = steady_clock::now() + kRecheckInterval;
      while (!ended_ && ended_changed_.wait_until(mutex_, next)) {
      }
      if (ended_) return;
    }
    if (control_->audit_updates() != nullptr) control_->audit_updates()->tick(unix_milliseconds());
    if (control_->enabled()) recheck();
  }
}

void Access::recheck() {
  const MutexLock lock(mutex_);
  if (!ended_) recheck_();
}

}  // namespace locus::server
