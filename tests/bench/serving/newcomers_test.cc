#include "tests/bench/serving/newcomers.h"

#include <gtest/gtest.h>

#include "tests/bench/serving/certificates.h"
#include "tests/bench/serving/ray_batches.h"

namespace locus::bench::serving {
namespace {

TEST(NewcomersTest, EachIsAnsweredOverTlsAsInThisProcess) {
  const auto certificates = Certificates::make();
  ASSERT_TRUE(certificates.ok()) << certificates.status();
  const auto daemon =
      Daemon::start((*certificates)->daemon_options(Transport::kTls), (*certificates)->client_options(Transport::kTls));
  ASSERT_TRUE(daemon.ok()) << daemon.status();
  const auto mesh = load_mesh("city:200");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  TwinScene scene(**daemon, "newcomers");
  ASSERT_TRUE(scene.create().ok());
  ASSERT_TRUE(scene.place(*mesh).ok());
  const Batches batches = batches_of(scattered_rays(*mesh, 48), 16, scene.name());
  Newcomers newcomers(**daemon, batches);
  EXPECT_EQ(newcomers.hashes(), LocalLoad(scene.here().latest(), batches, 1).hashes());
  newcomers.run(10);
  EXPECT_TRUE(newcomers.status().ok()) << newcomers.status();
}

TEST(NewcomersTest, ARefusedQueryIsAnError) {
  const auto daemon = Daemon::start();
  ASSERT_TRUE(daemon.ok()) << daemon.status();
  const auto mesh = load_mesh("city:200");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const Batches batches = batches_of(scattered_rays(*mesh, 16), 16, "no-such-scene");
  Newcomers newcomers(**daemon, batches);
  newcomers.run(4);
  EXPECT_EQ(newcomers.status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace locus::bench::serving
