#include "tests/bench/serving/certificates.h"

#include <gtest/gtest.h>

#include "tests/bench/serving/daemon.h"

namespace locus::bench::serving {
namespace {

TEST(CertificatesTest, ADaemonAdmitsItsClientsOverEachTransport) {
  const auto certificates = Certificates::make();
  ASSERT_TRUE(certificates.ok()) << certificates.status();
  for (const Transport transport : {Transport::kPlain, Transport::kTls, Transport::kMutualTls}) {
    const auto daemon =
        Daemon::start((*certificates)->daemon_options(transport), (*certificates)->client_options(transport));
    ASSERT_TRUE(daemon.ok()) << daemon.status();
    EXPECT_TRUE((*daemon)->client().get_server().ok());
  }
}

TEST(CertificatesTest, MutualTlsRefusesAClientWithoutACertificate) {
  const auto certificates = Certificates::make();
  ASSERT_TRUE(certificates.ok()) << certificates.status();
  const auto daemon = Daemon::start((*certificates)->daemon_options(Transport::kMutualTls),
                                    (*certificates)->client_options(Transport::kTls));
  EXPECT_EQ(daemon.status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace locus::bench::serving
