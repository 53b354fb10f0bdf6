#include "server/storage/postgres_cluster.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "tests/support/cluster_engine_judge.h"
#include "tests/support/log_fixture.h"
#include "tests/support/postgres_server.h"

namespace locus::server {
namespace {

// The tables of one PostgreSQL server, which all tests of this process share.
class PostgresUnderTest : public test::EngineUnderTest {
 public:
  PostgresUnderTest() {
    if (server() == nullptr) server() = std::make_unique<test::PostgresServer>();
    server()->query("DROP SCHEMA IF EXISTS locus CASCADE");
    auto opened = PostgresCluster::open(server()->options());
    EXPECT_TRUE(opened.ok()) << opened.status();
    cluster_ = *std::move(opened);
  }
  ClusterEngine& engine() override { return *cluster_; }
  SceneKey add_scene() override {
    ++scenes_;
    const std::string key = server()->query(
        absl::StrCat("INSERT INTO locus.scene (name, spec, epoch, apply_version, snapshot, snapshot_sequence,"
                     " snapshot_chain, chunks, chunk_bytes, digest, checksum) VALUES ('scene",
                     scenes_, "', '', 1, 1, 0, 0, 0, 0, 0, 0, 0) RETURNING key"));
    EXPECT_EQ(server()->query(absl::StrCat("INSERT INTO locus.scene_log VALUES (", key, ", 0, 0, 0, 0)")), "");
    return std::stoull(key);
  }
  static void end_server() { server() = nullptr; }

 private:
  static std::unique_ptr<test::PostgresServer>& server() {
    static std::unique_ptr<test::PostgresServer> server;
    return server;
  }

  std::unique_ptr<PostgresCluster> cluster_;
  int scenes_ = 0;
};

// Ends the shared server before the process ends.
class EndServer : public ::testing::Environment {
 public:
  void TearDown() override { PostgresUnderTest::end_server(); }
};
[[maybe_unused]] const auto* const kEndServer = ::testing::AddGlobalTestEnvironment(new EndServer);

}  // namespace
}  // namespace locus::server

namespace locus::test {

std::unique_ptr<EngineUnderTest> postgres_engine() { return std::make_unique<server::PostgresUnderTest>(); }
// Without PostgreSQL the list of engines is empty, and PostgresClusterTest says so.
INSTANTIATE_TEST_SUITE_P(
    Postgres, ClusterEngineJudge,
    ::testing::ValuesIn(PostgresServer::installed()
                            ? std::vector<std::function<std::unique_ptr<EngineUnderTest>()>>{postgres_engine}
                            : std::vector<std::function<std::unique_ptr<EngineUnderTest>()>>{}));
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ClusterEngineJudge);

}  // namespace locus::test

namespace locus::server {
namespace {

class PostgresClusterTest : public test::LogFixture {
 protected:
  void SetUp() override {
    if (!test::PostgresServer::installed()) GTEST_SKIP() << test::PostgresServer::kMissing;
    server_ = std::make_unique<test::PostgresServer>();
  }
  std::unique_ptr<PostgresLog> log_of(MemberId member) {
    PostgresOptions options = server_->options();
    options.member = member;
    auto log = PostgresLog::open(options);
    EXPECT_TRUE(log.ok()) << log.status();
    return log.ok() ? *std::move(log) : nullptr;
  }

  std::unique_ptr<test::PostgresServer> server_;
};

TEST_F(PostgresClusterTest, ATakeoverByTheClusterFencesTheLogOfTheFormerLeader) {
  auto cluster = PostgresCluster::open(server_->options());
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  for (const MemberId id : {10, 20}) ASSERT_EQ((*cluster)->join(id, {"host:1", "", "1"}, 0), absl::OkStatus());
  log_ = log_of(10);
  const SceneKey scene = create("a", 1);
  append(scene, 3);
  const auto led = (*cluster)->scenes_led_by(10);
  ASSERT_TRUE(led.ok()) << led.status();
  ASSERT_EQ(led->size(), 1u);
  EXPECT_EQ((*led)[0].token, 1u);
  EXPECT_EQ((*led)[0].last_sequence, 3u);
  EXPECT_EQ((*led)[0].epoch, 7u);
  const auto taken = (*cluster)->take_over(scene, 1, 20);
  ASSERT_TRUE(taken.ok()) << taken.status();
  EXPECT_EQ(test::append_records(*log_, scene, 7, 1).code(), absl::StatusCode::kAborted);

  const auto successor = log_of(20);
  EXPECT_EQ(successor->begin_leading(scene, 20, 1).status().code(), absl::StatusCode::kAborted) << "an old token";
  const auto stored = successor->begin_leading(scene, 20, taken->token);
  ASSERT_TRUE(stored.ok()) << stored.status();
  EXPECT_EQ(stored->last_sequence, 3u);
  EXPECT_EQ(test::append_records(*successor, scene, 7, 2), absl::OkStatus());
  EXPECT_EQ(log_of(10)->begin_leading(scene, 10, taken->token).status().code(), absl::StatusCode::kAborted)
      << "another member leads";
  log_ = log_of(20);
  ASSERT_TRUE(static_cast<PostgresLog&>(*log_).begin_leading(scene, 20, taken->token).ok());
  expect_records(scene, 1, 5);
}

TEST_F(PostgresClusterTest, AnEngineThatIsAwayIsUnavailable) {
  PostgresOptions options = server_->options();
  options.answer_wait = std::chrono::milliseconds(500);
  auto cluster = PostgresCluster::open(options);
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  ASSERT_EQ((*cluster)->join(10, {"host:1", "", "1"}, 0), absl::OkStatus());
  server_->stop(SIGKILL);
  EXPECT_EQ((*cluster)->beat(10, 0, 3).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ((*cluster)->members().status().code(), absl::StatusCode::kUnavailable);
  server_->start();
  EXPECT_TRUE((*cluster)->beat(10, 0, 3).ok());
}

}  // namespace
}  // namespace locus::server
