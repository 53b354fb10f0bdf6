#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/refusal.h"
#include "tests/support/postgres_log_fixture.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using ::testing::HasSubstr;

class PostgresLogMeshUsesTest : public test::PostgresLogFixture {
 protected:
  void SetUp() override {
    test::PostgresLogFixture::SetUp();
    if (own_ == nullptr) return;
    scene_ = create("a", 1);
    ASSERT_EQ(add_mesh("m", 1, {"content"}), absl::OkStatus());
    ASSERT_EQ(add_mesh("n", 2, {"another"}), absl::OkStatus());
  }
  // Returns the claims of all scenes as text.
  std::string claims() const {
    return engine_->query(
        "SELECT coalesce(string_agg(scene || ':' || name || ':' || instances, ' ' ORDER BY scene, name), '')"
        " FROM locus.scene_mesh");
  }
  static void expect_in_use(const absl::Status& status, const std::string& message, double instances) {
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(message));
    ASSERT_TRUE(refusal_of(status).has_value());
    EXPECT_EQ(refusal_of(status)->reason, Reason::kInUse);
    EXPECT_EQ(refusal_of(status)->field, "mesh");
    EXPECT_EQ(refusal_of(status)->asked, instances);
  }

  SceneKey scene_ = 0;
};

TEST_F(PostgresLogMeshUsesTest, ClaimsOfAllScenesAddUpAndKeepAMesh) {
  const auto other = another();
  const SceneKey second = test::create_scene(*other, "b", 2).value();
  const MeshUse both[] = {use_of("n", 2, 1), use_of("m", 1, 4), use_of("m", 1, 1)};
  ASSERT_EQ(own_->claim_meshes(scene_, both), absl::OkStatus());
  ASSERT_EQ(own_->claim_meshes(scene_, {use_of("m", 1, 2)}), absl::OkStatus());
  ASSERT_EQ(other->claim_meshes(second, {use_of("m", 1, 3)}), absl::OkStatus());
  EXPECT_EQ(claims(), "1:m:7 1:n:1 2:m:3");
  expect_in_use(log_->delete_mesh("m"), "mesh m is used by 10 instances; remove them first", 10);
  expect_in_use(other->delete_mesh("n"), "mesh n is used by 1 instances", 1);
  EXPECT_EQ(own_->claim_meshes(scene_, {}), absl::OkStatus());
}

TEST_F(PostgresLogMeshUsesTest, AClaimWithoutInstancesKeepsAMeshThatIsBeingPlaced) {
  ASSERT_EQ(own_->claim_meshes(scene_, {use_of("m", 1, 0)}), absl::OkStatus());
  expect_in_use(log_->delete_mesh("m"), "mesh m is being placed", 0);
}

TEST_F(PostgresLogMeshUsesTest, ExactNumbersReplaceAllClaimsOfTheScene) {
  const auto other = another();
  const SceneKey second = test::create_scene(*other, "b", 2).value();
  ASSERT_EQ(other->claim_meshes(second, {use_of("n", 2, 9)}), absl::OkStatus());
  ASSERT_EQ(own_->claim_meshes(scene_, {use_of("m", 1, 2)}), absl::OkStatus());
  const MeshUse exact[] = {use_of("n", 2, 5), use_of("m", 1, 1)};
  ASSERT_EQ(own_->set_mesh_uses(scene_, exact), absl::OkStatus());
  EXPECT_EQ(claims(), "1:m:1 1:n:5 2:n:9");
  const MeshUse none_of_m[] = {use_of("n", 2, 5), use_of("m", 1, 0)};
  ASSERT_EQ(own_->set_mesh_uses(scene_, none_of_m), absl::OkStatus());
  EXPECT_EQ(claims(), "1:n:5 2:n:9");
  ASSERT_EQ(own_->set_mesh_uses(scene_, {}), absl::OkStatus());
  EXPECT_EQ(claims(), "2:n:9");
  EXPECT_EQ(log_->delete_mesh("m"), absl::OkStatus());
}

TEST_F(PostgresLogMeshUsesTest, ClaimsGoWithTheirScene) {
  ASSERT_EQ(own_->claim_meshes(scene_, {use_of("m", 1, 2)}), absl::OkStatus());
  EXPECT_FALSE(log_->delete_mesh("m").ok());
  ASSERT_EQ(log_->delete_scene(scene_), absl::OkStatus());
  EXPECT_EQ(claims(), "");
  EXPECT_EQ(log_->delete_mesh("m"), absl::OkStatus());
}

TEST_F(PostgresLogMeshUsesTest, AMissingMeshOrOtherContentIsNamedAndNothingIsClaimed) {
  for (const MeshUse& wrong : {use_of("missing", 1, 1), use_of("n", 1, 1)}) {
    const MeshUse uses[] = {use_of("m", 1, 1), wrong};
    for (const absl::Status& status : {own_->claim_meshes(scene_, uses), own_->set_mesh_uses(scene_, uses)}) {
      EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
      EXPECT_THAT(std::string(status.message()), HasSubstr(absl::StrCat("'", wrong.name, "'")));
    }
  }
  EXPECT_EQ(claims(), "");
  EXPECT_EQ(own_->claim_meshes(77, {use_of("m", 1, 1)}).code(), absl::StatusCode::kNotFound);
}

TEST_F(PostgresLogMeshUsesTest, AFormerLeaderClaimsNothing) {
  ASSERT_TRUE(another()->take_over(scene_, 1).ok());
  EXPECT_EQ(own_->claim_meshes(scene_, {use_of("m", 1, 1)}).code(), absl::StatusCode::kAborted);
  EXPECT_EQ(own_->set_mesh_uses(scene_, {use_of("m", 1, 1)}).code(), absl::StatusCode::kAborted);
  EXPECT_EQ(claims(), "");
}

// Connections end at random, so the outcome of many commits is unknown at first.
TEST_F(PostgresLogMeshUsesTest, AClaimWhoseAnswerIsLostCountsOnce) {
  std::atomic<bool> ended = false;
  std::thread disturber([&] {
    while (!ended) {
      engine_->query("SELECT count(pg_terminate_backend(pid)) FROM pg_stat_activity WHERE application_name = 'locusd'");
      std::this_thread::sleep_for(std::chrono::milliseconds(15));
    }
  });
  uint64_t claimed = 0;
  for (int i = 0; i < 100; ++i) {
    const absl::Status status = own_->claim_meshes(scene_, {use_of("m", 1, 3)});
    EXPECT_TRUE(status.ok() || absl::IsUnavailable(status)) << status;
    if (status.ok()) claimed += 3;
  }
  ended = true;
  disturber.join();
  EXPECT_GT(claimed, 0u);
  EXPECT_EQ(claims(), absl::StrCat("1:m:", claimed));
}

TEST_F(PostgresLogMeshUsesTest, AMeshIsNeverClaimedAndDeletedAtTheSameTime) {
  const auto other = another();
  const uint64_t rounds = test::scaled_count(200);
  uint64_t claims_won = 0;
  for (uint64_t round = 0; round < rounds; ++round) {
    const std::string name = absl::StrCat("raced", round);
    ASSERT_EQ(add_mesh(name, 3, {"content of the raced"}), absl::OkStatus());
    absl::Status claimed, deleted;
    const auto claim = [&] { claimed = own_->claim_meshes(scene_, {use_of(name, 3, 1)}); };
    const auto remove = [&] { deleted = other->delete_mesh(name); };
    // The one that needs no new thread begins first as a rule.
    const bool claim_first = round % 2 == 0;
    std::thread second([&] { claim_first ? remove() : claim(); });
    claim_first ? claim() : remove();
    second.join();
    ASSERT_NE(claimed.ok(), deleted.ok()) << "round " << round << ": " << claimed << "; " << deleted;
    if (claimed.ok()) {
      ++claims_won;
      EXPECT_EQ(deleted.code(), absl::StatusCode::kFailedPrecondition) << deleted;
      ASSERT_EQ(own_->set_mesh_uses(scene_, {}), absl::OkStatus());
      ASSERT_EQ(other->delete_mesh(name), absl::OkStatus());
    } else {
      EXPECT_EQ(claimed.code(), absl::StatusCode::kNotFound) << claimed;
    }
  }
  EXPECT_GT(claims_won, 0u);
  EXPECT_LT(claims_won, rounds);
}

}  // namespace
}  // namespace locus::server
