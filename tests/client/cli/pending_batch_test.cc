#include "client/cli/pending_batch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/failure.h"
#include "client/lib/update_builder.h"

namespace locus::cli {
namespace {

using client::UpdateBuilder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr client::Double3 kHere = {1, 2, 3};

v1::UpdateBatch inserts(uint64_t id) { return UpdateBuilder().insert_ball(id, kHere, 1).build(); }
v1::UpdateBatch moves(uint64_t id) { return UpdateBuilder().move(id, kHere).build(); }
v1::UpdateBatch removes(uint64_t id) { return UpdateBuilder().remove(id).build(); }

class PendingBatchTest : public ::testing::Test {
 protected:
  // Adds the items of `line` to the pending batch. Returns the error message, or "" if they were added.
  std::string add(const v1::UpdateBatch& line, const std::string& scene = "arena") {
    const v1::UpdateBatch before = pending_.batch();
    const absl::Status added = pending_.add(scene, line);
    if (added.ok()) return "";
    EXPECT_EQ(exit_code_of(added), ExitCode::kUsage);
    EXPECT_EQ(pending_.batch().SerializeAsString(), before.SerializeAsString());
    return std::string(added.message());
  }

  PendingBatch pending_{5};
};

TEST_F(PendingBatchTest, LinesBecomeOneBatchUnderOneTick) {
  EXPECT_EQ(pending_.scene(), "");
  EXPECT_EQ(add(removes(1)), "");
  EXPECT_EQ(add(inserts(2)), "");
  EXPECT_EQ(add(inserts(3)), "");
  EXPECT_EQ(add(moves(4)), "");
  EXPECT_EQ(pending_.scene(), "arena");
  const v1::UpdateBatch& batch = pending_.batch();
  EXPECT_EQ(batch.tick(), 5u);
  EXPECT_THAT(batch.remove_ids(), ElementsAre(1));
  EXPECT_EQ(batch.inserts_size(), 2);
  EXPECT_THAT(batch.moves(0).ids(), ElementsAre(4));
}

TEST_F(PendingBatchTest, LinesAboutDifferentObjectsMayComeInAnyOrder) {
  EXPECT_EQ(add(moves(1)), "");
  EXPECT_EQ(add(inserts(2)), "");
  EXPECT_EQ(add(removes(3)), "");
}

TEST_F(PendingBatchTest, LinesAboutOneObjectMustComeInTheOrderOfTheBatch) {
  EXPECT_EQ(add(removes(1)), "");
  EXPECT_EQ(add(inserts(1)), "") << "a new life";
  EXPECT_EQ(add(moves(1)), "");
  EXPECT_EQ(add(moves(1)), "") << "the later move stays";
  EXPECT_THAT(add(inserts(1)), HasSubstr("an earlier line of it already changes 1"));
  EXPECT_EQ(add(inserts(2)), "");
  EXPECT_THAT(add(removes(2)), HasSubstr("an earlier line of it already inserts 2"));
}

TEST_F(PendingBatchTest, ARelabelMustComeAfterMovesOfTheSameObject) {
  EXPECT_EQ(add(UpdateBuilder().relabel(1, {.tag = 7}).build()), "");
  EXPECT_THAT(add(moves(1)), HasSubstr("already changes 1"));
}

TEST_F(PendingBatchTest, RemovingAllOrAGroupMustComeFirst) {
  EXPECT_EQ(add(UpdateBuilder().clear().build()), "");
  EXPECT_EQ(add(UpdateBuilder().remove_group(3).build()), "");
  EXPECT_EQ(add(removes(1)), "");
  EXPECT_THAT(add(UpdateBuilder().clear().build()), HasSubstr("put this line first"));
  EXPECT_EQ(add(UpdateBuilder().remove_group(4).build()), "");
  EXPECT_EQ(add(inserts(1)), "");
  EXPECT_THAT(add(UpdateBuilder().remove_group(5).build()), HasSubstr("put this line first"));
}

TEST_F(PendingBatchTest, ALineForAnotherSceneIsRefused) {
  EXPECT_EQ(add(inserts(1)), "");
  EXPECT_EQ(add(inserts(2), "hall"), "a batch is for one scene: this one is for arena, commit it before changing hall");
}

TEST_F(PendingBatchTest, ALineWithItsOwnTickUpsertOrFrameIsRefused) {
  EXPECT_THAT(add(UpdateBuilder().tick(6).move(1, kHere).build()), HasSubstr("begin --tick N"));
  EXPECT_EQ(add(inserts(1)), "");
  EXPECT_THAT(add(UpdateBuilder().upsert().insert_ball(2, kHere, 1).build()), HasSubstr("--upsert"));
  EXPECT_THAT(add(UpdateBuilder().frame(kHere).move(9, kHere).build()), HasSubstr("its own batch"));
}

}  // namespace
}  // namespace locus::cli
