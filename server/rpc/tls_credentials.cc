#include "server/rpc/tls_credentials.h"

#include <grpc/grpc.h>

#include <chrono>
#include <string>
#include <utility>

#include "core/base/status_macros.h"
#include "server/observability/log.h"

namespace locus::server {
namespace {

constexpr std::chrono::seconds kLookForChanges{1};

// Wraps credentials of gRPC's C interface for its C++ interface, whose SslServerCredentials cannot reload files.
class FetchingCredentials final : public grpc::ServerCredentials {
 public:
  // Takes ownership of `credentials`.
  explicit FetchingCredentials(grpc_server_credentials* credentials) : credentials_(credentials) {}
  ~FetchingCredentials() override { grpc_server_credentials_release(credentials_); }

  // Does nothing: calls are authenticated by the services.
  void SetAuthMetadataProcessor(const std::shared_ptr<grpc::AuthMetadataProcessor>&) override {}

 private:
  int AddPortToServer(const std::string& address, grpc_server* server) override {
    return grpc_server_add_http2_port(server, address.c_str(), credentials_);
  }

  grpc_server_credentials* const credentials_;
};

void log_warnings(const TlsFiles& files, const TlsContents& contents) {
  for (const std::string& text : warnings_about(files, contents)) log(LogLevel::kWarning, "tls", {{"text", text}});
}

}  // namespace

absl::StatusOr<std::unique_ptr<TlsCredentials>> TlsCredentials::start(const TlsFiles& files, TlsHooks hooks) {
  ASSIGN_OR_RETURN(TlsContents contents, read_tls_files(files));
  RETURN_IF_ERROR(check_tls_contents(files, contents));
  log_warnings(files, contents);
  return std::unique_ptr<TlsCredentials>(new TlsCredentials(files, std::move(hooks), std::move(contents)));
}

TlsCredentials::TlsCredentials(TlsFiles files, TlsHooks hooks, TlsContents contents)
    : files_(std::move(files)), hooks_(std::move(hooks)), contents_(std::move(contents)), thread_([this] { run(); }) {}

TlsCredentials::~TlsCredentials() {
  {
    const MutexLock lock(mutex_);
    ended_ = true;
    end_.notify_all();
  }
  thread_.join();
}

std::shared_ptr<grpc::ServerCredentials> TlsCredentials::grpc_credentials() {
  const auto clients = files_.client_ca.empty() ? GRPC_SSL_DONT_REQUEST_CLIENT_CERTIFICATE
                                                : GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY;
  // These options accept TLS 1.2 and 1.3, the default of gRPC.
  return std::make_shared<FetchingCredentials>(grpc_ssl_server_credentials_create_with_options(
      grpc_ssl_server_credentials_create_options_using_config_fetcher(clients, &TlsCredentials::fetch, this)));
}

bool TlsCredentials::reload() {
  const std::optional<Change> change = replace(read_tls_files(files_));
  if (!change) return false;
  if (lacks_certificate(change->before, change->now)) hooks_.authority_removed();
  return true;
}

std::optional<TlsCredentials::Change> TlsCredentials::replace(absl::StatusOr<TlsContents> contents) {
  const MutexLock lock(mutex_);
  if (!contents.ok()) {
    note_failure(contents.status());
    return std::nullopt;
  }
  if (*contents == contents_) {
    if (!last_failure_.ok() && logged_) note_success();  // the bad files were replaced by those in use
    last_failure_ = absl::OkStatus();
    return std::nullopt;
  }
  if (const absl::Status checked = check_tls_contents(files_, *contents); !checked.ok()) {
    note_failure(checked);
    return std::nullopt;
  }
  Change change{std::move(contents_.client_ca), contents->client_ca};
  contents_ = *std::move(contents);
  fetched_ = false;
  last_failure_ = absl::OkStatus();
  reloads_.fetch_add(1);
  note_success();
  log_warnings(files_, contents_);
  return change;
}

TlsContents TlsCredentials::contents() const {
  const MutexLock lock(mutex_);
  return contents_;
}

// Passes the contents to gRPC, unless gRPC has them already.
grpc_ssl_certificate_config_reload_status TlsCredentials::fetch(void* self,
                                                                grpc_ssl_server_certificate_config** config) {
  auto& credentials = *static_cast<TlsCredentials*>(self);
  const MutexLock lock(credentials.mutex_);
  if (std::exchange(credentials.fetched_, true)) return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_UNCHANGED;
  const TlsContents& contents = credentials.contents_;
  const grpc_ssl_pem_key_cert_pair pair{contents.key.c_str(), contents.certificate.c_str()};
  // gRPC requires CA certificates here even if it asks clients for no certificate. It then ignores the CA certificates,
  // so pass any certificates.
  const std::string& roots = contents.client_ca.empty() ? contents.certificate : contents.client_ca;
  *config = grpc_ssl_server_certificate_config_create(roots.c_str(), &pair, 1);
  return GRPC_SSL_CERTIFICATE_CONFIG_RELOAD_NEW;
}

void TlsCredentials::run() {
  while (true) {
    {
      const std::chrono::steady_clock::time_point next = std::chrono::steady_clock::now() + kLookForChanges;
      const MutexLock lock(mutex_);
      while (!ended_ && end_.wait_until(mutex_, next)) {
      }
      if (ended_) return;
    }
    reload();
    hooks_.second_passed();
  }
}

// Stores a failure, and logs it only when it occurs a second time in a row, because files that are replaced one after
// another do not match each other for a moment.
void TlsCredentials::note_failure(const absl::Status& why) {
  if (why != last_failure_) {
    last_failure_ = why;
    logged_ = false;
    return;
  }
  if (std::exchange(logged_, true)) return;
  failures_.fetch_add(1);
  hooks_.reloaded(why);
  log(LogLevel::kError, "changed TLS files cannot be used; the previous files stay in use",
      {{"reason", std::string(why.message())}});
}

void TlsCredentials::note_success() {
  log(LogLevel::kInfo, "tls files reloaded", {{"certificate", files_.certificate}});
  hooks_.reloaded(absl::OkStatus());
}

}  // namespace locus::server
