// Tests of what a cluster needs of the catalogue: scenes without a leader, reports of fences and tokens, versions of
// records, and readers that do not lead.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "server/storage/postgres_cluster.h"
#include "tests/support/postgres_log_fixture.h"

namespace locus::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

class PostgresLogCatalogueTest : public test::PostgresLogFixture {
 protected:
  using Fences = std::vector<std::pair<SceneKey, uint64_t>>;

  absl::StatusOr<SceneKey> create_unled(const std::string& name, SceneKey key) {
    const test::ChunksFrom state(test::snapshot_chunks(key, 0));
    return own_->create_unled_scene(name, "spec", 7, state);
  }
  // Opens a log that calls its own members when it reports, as a daemon may.
  std::unique_ptr<PostgresLog> reporting(PostgresOptions options) {
    options.on_fenced = [this](SceneKey scene, uint64_t token) {
      fences_.emplace_back(scene, token);
      EXPECT_EQ(reporting_->token_of(scene).value_or(0), token);
    };
    auto log = another(options);
    reporting_ = log.get();
    return log;
  }

  Fences fences_;
  PostgresLog* reporting_ = nullptr;
};

TEST_F(PostgresLogCatalogueTest, AnUnledSceneIsLedByNobodyUntilItIsPlaced) {
  ASSERT_TRUE(create_unled("a", 1).ok());
  const CatalogueScene scene = own_->find_catalogued("a").value().value();
  EXPECT_EQ(scene.key, 1u);
  EXPECT_EQ(scene.spec, "spec");
  EXPECT_EQ(scene.epoch, 7u);
  EXPECT_EQ(scene.member, 0u);
  EXPECT_EQ(scene.token, 0u);
  EXPECT_EQ(test::append_records(*log_, 1, 7, 1).code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(create_unled("a", 2).status().code(), absl::StatusCode::kAlreadyExists);

  auto cluster = PostgresCluster::open(engine_->options());
  ASSERT_TRUE(cluster.ok()) << cluster.status();
  EXPECT_EQ((*cluster)->scenes_without_leader()->size(), 1u);
  ASSERT_EQ((*cluster)->join(10, {"host:1", "", "1"}, 0), absl::OkStatus());
  ASSERT_TRUE((*cluster)->take_over(1, 0, 10).ok());
  ASSERT_TRUE(own_->begin_leading(1, 10, 1).ok());
  append(1, 3);
  expect_snapshot(1, 0);
  expect_records(1, 1, 3);
}

TEST_F(PostgresLogCatalogueTest, AFenceIsReportedOnceForEachLeadership) {
  const auto log = reporting(engine_->options());
  const SceneKey scene = test::create_scene(*log, "a", 1).value();
  const SceneKey kept = test::create_scene(*log, "kept", 2).value();
  ASSERT_TRUE(own_->take_over(scene, 1).ok());
  EXPECT_TRUE(fences_.empty()) << "nobody has noticed it";
  EXPECT_EQ(test::append_records(*log, scene, 7, 1).code(), absl::StatusCode::kAborted);
  EXPECT_THAT(fences_, ElementsAre(Pair(scene, 1)));
  EXPECT_EQ(test::append_records(*log, scene, 7, 1).code(), absl::StatusCode::kAborted);
  EXPECT_EQ(log->set_scene_spec(scene, "another").code(), absl::StatusCode::kAborted);
  EXPECT_EQ(test::append_records(*log, kept, 7, 1), absl::OkStatus());
  EXPECT_EQ(fences_.size(), 1u);
  ASSERT_TRUE(log->take_over(scene, 2).ok());
  EXPECT_EQ(fences_.size(), 1u) << "a daemon that leads again is not fenced";
  ASSERT_TRUE(own_->take_over(scene, 3).ok());
  EXPECT_EQ(log->delete_scene(scene).code(), absl::StatusCode::kAborted);
  EXPECT_THAT(fences_, ElementsAre(Pair(scene, 1), Pair(scene, 3)));
}

TEST_F(PostgresLogCatalogueTest, EachChangeOfASceneReportsAFence) {
  const auto log = reporting(engine_->options());
  ASSERT_EQ(add_mesh("m", 1, {"content"}), absl::OkStatus());
  const std::vector<std::function<absl::Status(SceneKey)>> changes = {
      [&](SceneKey scene) { return test::append_records(*log, scene, 7, 1); },
      [&](SceneKey scene) { return test::write_snapshot(*log, scene, 0); },
      [&](SceneKey scene) { return log->set_scene_spec(scene, "another"); },
      [&](SceneKey scene) { return log->restart_scene(scene, 8); },
      [&](SceneKey scene) { return log->claim_meshes(scene, {use_of("m", 1, 1)}); },
      [&](SceneKey scene) { return log->set_mesh_uses(scene, {}); },
      [&](SceneKey scene) { return log->delete_scene(scene); }};
  for (const auto& change : changes) {
    const SceneKey scene = test::create_scene(*log, absl::StrCat("scene", fences_.size()), 1).value();
    ASSERT_TRUE(own_->take_over(scene, 1).ok());
    const size_t before = fences_.size();
    EXPECT_EQ(change(scene).code(), absl::StatusCode::kAborted);
    ASSERT_EQ(fences_.size(), before + 1);
    EXPECT_EQ(fences_.back(), std::pair(scene, uint64_t{1}));
  }
}

TEST_F(PostgresLogCatalogueTest, RecordsOfAnotherVersionAreNotReplayed) {
  PostgresOptions options = engine_->options();
  options.apply_version = kApplyVersion + 1;
  options.member = 10;
  const auto newer = another(options);
  const SceneKey scene = test::create_scene(*newer, "a", 1).value();
  ASSERT_TRUE(own_->take_over(scene, 1).ok()) << "a snapshot alone is read by every version";
  append(scene, 2);
  const auto refused = newer->take_over(scene, 2);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("records of version 1"));
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("'a'"));
  EXPECT_EQ(newer->begin_leading(scene, 10, 3).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(test::append_records(*newer, scene, 7, 1).code(), absl::StatusCode::kAborted);
  // The version that wrote them leaves nothing to replay.
  ASSERT_TRUE(own_->take_over(scene, 3).ok());
  ASSERT_EQ(test::write_snapshot(*log_, scene, 2), absl::OkStatus());
  ASSERT_TRUE(newer->take_over(scene, 4).ok());
  ASSERT_EQ(test::append_records(*newer, scene, 7, 1), absl::OkStatus());
  ASSERT_TRUE(newer->take_over(scene, 5).ok()) << "the records are of its own version";
  EXPECT_EQ(own_->take_over(scene, 6).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(PostgresLogCatalogueTest, AFollowerReadsAcknowledgedRecordsUpToANumber) {
  const SceneKey scene = create("a", 1);
  append(scene, 9);
  const auto follower = another();
  const auto read = [&](uint64_t from, uint64_t until) {
    std::vector<uint64_t> found;
    EXPECT_EQ(follower->read_until(scene, from, until,
                                   [&](const LogRecord& record) {
                                     EXPECT_EQ(record.entry.bytes, test::record_bytes(scene, record.sequence));
                                     found.push_back(record.sequence);
                                     return absl::OkStatus();
                                   }),
              absl::OkStatus());
    return found;
  };
  EXPECT_THAT(read(1, 3), ElementsAre(1, 2, 3));
  EXPECT_THAT(read(4, 4), ElementsAre(4));
  EXPECT_THAT(read(8, 100), ElementsAre(8, 9));
  EXPECT_THAT(read(5, 4), ElementsAre());
  EXPECT_THAT(read(10, 20), ElementsAre());
  append(scene, 1);
  uint64_t last = 0;
  EXPECT_EQ(test::record_difference(*follower, scene, 1, last), "");
  EXPECT_EQ(last, 10u);
  ASSERT_EQ(test::write_snapshot(*log_, scene, 4), absl::OkStatus());
  EXPECT_EQ(follower->read_until(scene, 4, 6, [](const LogRecord&) { return absl::OkStatus(); }).code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(read(5, 6), ElementsAre(5, 6));
  EXPECT_EQ(engine_->query("UPDATE locus.record SET batch = 99 WHERE sequence = 6"), "");
  EXPECT_EQ(follower->read_until(scene, 5, 6, [](const LogRecord&) { return absl::OkStatus(); }).code(),
            absl::StatusCode::kDataLoss);
}

}  // namespace
}  // namespace locus::server
