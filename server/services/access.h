// Access control of a server: reads the files of identities, rights and quotas, and reads them again when they change.
// Makes running calls check their rights after each change, and check twice a second whether their credentials expired.
//
// Threads: reload() from any thread. Between start() and stop(), one thread watches the files, and another one makes
// calls check for expired credentials.
#ifndef LOCUS_SERVER_SERVICES_ACCESS_H_
#define LOCUS_SERVER_SERVICES_ACCESS_H_

#include <functional>
#include <memory>
#include <optional>
#include <thread>

#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "server/config/server_config.h"
#include "server/rpc/rpc_state.h"
#include "server/security/access_control.h"
#include "server/security/file_watcher.h"

namespace locus::server {

class Access {
 public:
  // Reads the files that `config` names and sets `state.access`. Returns an error that names the file and its mistake.
  // `state` must outlive the result.
  static absl::StatusOr<std::unique_ptr<Access>> open(const ServerConfig& config, RpcState& state);
  ~Access();
  Access(const Access&) = delete;
  Access& operator=(const Access&) = delete;

  // With access control, starts two threads. The first reads the files once more and then watches them. The second
  // calls `recheck_calls` twice a second, because credentials expire, and writes the counts of updates to the audit
  // log. Without access control, starts only the second thread, and only if there is an audit log, for the counts of
  // updates. `recheck_calls` must make every running call check its rights; it is also called after each change of the
  // files.
  void start(std::function<void()> recheck_calls);
  // Ends the threads. `recheck_calls` is not called afterwards.
  void stop();

  // Reads the files again. If a file has a mistake, keeps the old rules and logs the mistake as an error.
  void reload();

 private:
  Access(RpcState& state, std::unique_ptr<AccessControl> control) : state_(state), control_(std::move(control)) {}
  // Logs, counts and audits the result of reading the files. Does nothing if there are no files.
  void report(const absl::Status& status) const;
  // Reads the files again for the watcher. Returns false if a file has a mistake. Logs the same mistake only once,
  // because the watcher repeats a failed reading each second.
  bool reload_watched();
  void run_clock() LOCUS_EXCLUDES(mutex_);
  // Calls recheck_ unless stop() was called.
  void recheck() LOCUS_EXCLUDES(mutex_);

  RpcState& state_;
  const std::unique_ptr<AccessControl> control_;
  std::function<void()> recheck_;
  // Result of the watcher's last reading. Used by the watcher's thread only, like the next member.
  absl::Status last_reading_;
  bool read_by_watcher_ = false;  // true after the watcher's first reading
  std::optional<FileWatcher> watcher_;
  std::thread clock_;
  Mutex mutex_;
  ConditionVariable ended_changed_;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_ACCESS_H_
