// TLS for the connections of a server: the credentials for gRPC, and a thread that looks for changed files each second.
// New connections use the newest valid files; existing connections keep the files with which they began, so no call is
// dropped. Files that cannot be used are logged as an error once, and the previous files stay in use. Certificate, key
// and client CA are always replaced together, in memory, so a key is never used with another certificate. TlsHooks
// notify the owner, which ends the connections of clients that are no longer trusted.
//
// When a connection begins, gRPC calls fetch() for new files, without a lock of its own. That is safe, because only the
// acceptor's thread hands connections over to gRPC.
//
// Threads: the members may be called from any thread.
#ifndef LOCUS_SERVER_RPC_TLS_CREDENTIALS_H_
#define LOCUS_SERVER_RPC_TLS_CREDENTIALS_H_

#include <grpc/grpc_security.h>
#include <grpcpp/security/server_credentials.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "absl/status/statusor.h"
#include "core/base/mutex.h"
#include "server/security/tls_files.h"

namespace locus::server {

// Callbacks of TlsCredentials, called on its thread. reload() also calls authority_removed and reloaded, on its
// caller's thread. The callbacks must not call functions of the TlsCredentials.
struct TlsHooks {
  // Called when a certificate of the client CA has been removed and the new files are in use. Connections that begin
  // after the call use the new files.
  std::function<void()> authority_removed = [] {};
  std::function<void()> second_passed = [] {};  // called each second
  // Called with OK when changed files were put into use, and with the reason when changed files could not be used. Also
  // called with OK when files that could not be used have been replaced by the files that are in use.
  std::function<void(const absl::Status&)> reloaded = [](const absl::Status&) {};
};

class TlsCredentials {
 public:
  // Reads the files and starts the thread. Returns an error that names the file and the reason if they cannot be used.
  static absl::StatusOr<std::unique_ptr<TlsCredentials>> start(const TlsFiles& files, TlsHooks hooks = {});
  // Ends the thread. The gRPC server must have ended before.
  ~TlsCredentials();
  TlsCredentials(const TlsCredentials&) = delete;
  TlsCredentials& operator=(const TlsCredentials&) = delete;

  // Returns credentials for TLS 1.2 and 1.3, for one acceptor. If there is a file of client CAs, every client must have
  // a certificate that one of them has signed.
  std::shared_ptr<grpc::ServerCredentials> grpc_credentials();

  // Reads the files again immediately. Returns true if the files have changed and the new contents are now in use.
  bool reload() LOCUS_EXCLUDES(mutex_);

  // Returns the contents in use.
  TlsContents contents() const LOCUS_EXCLUDES(mutex_);

  // Return how often changed files were put into use, and how often changed files could not be used.
  uint64_t reloads() const { return reloads_.load(); }
  uint64_t failures() const { return failures_.load(); }

 private:
  TlsCredentials(TlsFiles files, TlsHooks hooks, TlsContents contents);
  static grpc_ssl_certificate_config_reload_status fetch(void* self, grpc_ssl_server_certificate_config** config);
  // Certificates of the client CA before and after a change of the files, in PEM.
  struct Change {
    std::string before;
    std::string now;
  };
  // If `contents` are new and valid, puts them into use and returns the change of the client CA. Otherwise returns
  // nullopt.
  std::optional<Change> replace(absl::StatusOr<TlsContents> contents) LOCUS_EXCLUDES(mutex_);
  void run() LOCUS_EXCLUDES(mutex_);
  void note_failure(const absl::Status& why) LOCUS_REQUIRES(mutex_);
  void note_success() LOCUS_REQUIRES(mutex_);

  const TlsFiles files_;
  const TlsHooks hooks_;
  std::atomic<uint64_t> reloads_{0};
  std::atomic<uint64_t> failures_{0};
  mutable Mutex mutex_;
  ConditionVariable end_;
  bool ended_ LOCUS_GUARDED_BY(mutex_) = false;
  TlsContents contents_ LOCUS_GUARDED_BY(mutex_);
  bool fetched_ LOCUS_GUARDED_BY(mutex_) = false;       // gRPC has the present contents
  absl::Status last_failure_ LOCUS_GUARDED_BY(mutex_);  // OK if the files are in use
  bool logged_ LOCUS_GUARDED_BY(mutex_) = false;        // the last failure is logged
  std::thread thread_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_TLS_CREDENTIALS_H_
