#include "server/rpc/peer_identity.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>

#include "core/base/mutex.h"
#include "server/rpc/tls_credentials.h"
#include "tests/support/raw_call.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificates.h"

namespace locus::server {
namespace {

using test::TestAuthority;
using test::TestCertificate;

// Service that ends every call immediately and stores the name in the caller's certificate.
class NamingService final : public grpc::CallbackGenericService {
 public:
  std::optional<std::string> last_name() {
    const MutexLock lock(mutex_);
    return last_name_;
  }

 private:
  class Ended final : public grpc::ServerGenericBidiReactor {
   public:
    void OnDone() override { delete this; }
  };

  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext* context) override {
    {
      const MutexLock lock(mutex_);
      last_name_ = certificate_name(*context);
    }
    auto* const reactor = new Ended;
    reactor->Finish(grpc::Status::OK);
    return reactor;
  }

  Mutex mutex_;
  std::optional<std::string> last_name_;
};

class PeerIdentityTest : public ::testing::Test {
 protected:
  void start(bool with_clients) {
    const TestCertificate own = authority_.for_server();
    test::replace_file(folder_.file("crt"), own.certificate);
    test::replace_file(folder_.file("key"), own.key);
    test::replace_file(folder_.file("ca"), authority_.certificate());
    auto credentials = TlsCredentials::start(
        {folder_.file("crt"), folder_.file("key"), with_clients ? folder_.file("ca") : std::string()});
    ASSERT_TRUE(credentials.ok()) << credentials.status();
    credentials_ = *std::move(credentials);
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", credentials_->grpc_credentials(), &port_);
    builder.RegisterCallbackGenericService(&service_);
    server_ = builder.BuildAndStart();
    ASSERT_NE(server_, nullptr);
  }

  // Returns the name that the server sees in a call of a client with this certificate.
  std::optional<std::string> name_of(const TestCertificate& own) {
    grpc::SslCredentialsOptions options;
    options.pem_root_certs = authority_.certificate();
    options.pem_cert_chain = own.certificate;
    options.pem_private_key = own.key;
    const auto channel = grpc::CreateChannel("127.0.0.1:" + std::to_string(port_), grpc::SslCredentials(options));
    test::raw_call(channel, "/any/method", "");
    return service_.last_name();
  }

  const TestAuthority authority_{"authority"};
  const test::TemporaryFolder folder_;
  std::unique_ptr<TlsCredentials> credentials_;
  NamingService service_;
  int port_ = 0;
  std::unique_ptr<grpc::Server> server_;  // destroyed before the service and the credentials
};

TEST_F(PeerIdentityTest, AUriComesBeforeADnsNameAndThatBeforeTheCommonName) {
  start(true);
  EXPECT_EQ(name_of(authority_.issue({.common_name = "common"})), "common");
  EXPECT_EQ(name_of(authority_.issue({.common_name = "common", .alternative_names = "DNS:game.example"})),
            "game.example");
  EXPECT_EQ(name_of(authority_.issue(
                {.common_name = "common", .alternative_names = "DNS:game.example,URI:spiffe://games/lobby"})),
            "spiffe://games/lobby");
}

TEST_F(PeerIdentityTest, ACallerWithoutACertificateHasNoName) {
  start(false);
  EXPECT_EQ(name_of({}), std::nullopt);
}

}  // namespace
}  // namespace locus::server
