// Times of queries: which are kept, what is said of those that are not, and what a batch answers.
#include "core/query/kinds/query_times.h"

#include "core/query/columns.h"
#include "core/query/run/run_batch.h"
#include "tests/support/owned_block.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

SceneSpec ten_ticks() {
  SceneSpec spec;
  spec.history = {10, uint64_t{1} << 30};
  return spec;
}

// Point 1 is at (t, 0, 0) at tick t, up to 30; it is in group 4.
class QueryTimesTest : public SceneFixture {
 protected:
  QueryTimesTest() : SceneFixture(ten_ticks()) {}
  void SetUp() override {
    InsertColumns insert = points({1}, {0, 0, 0});
    insert.groups = columns_.ids({4});
    apply(with(insert));
    for (uint64_t tick = 1; tick <= 30; ++tick) {
      UpdateBatch batch = with(move_to({1}, {static_cast<float>(tick), 0, 0}));
      batch.tick = tick;
      apply(batch);
    }
  }

  static OwnedBlock where(std::vector<uint64_t> ticks, std::vector<float> fractions = {}) {
    OwnedBlock block;
    block.settings.kind = LookupColumns{};
    block.ids.assign(ticks.size(), 1);
    block.as_of_ticks = std::move(ticks);
    block.as_of_fractions = std::move(fractions);
    return block;
  }
  static std::vector<double> xs(const BlockResult& result) {
    std::vector<double> xs;
    for (size_t i = 0; i < result.positions.size(); i += 3) xs.push_back(result.positions[i]);
    return xs;
  }
  absl::Status refusal(const OwnedBlock& block) const {
    QueryBatch batch;
    batch.blocks = {block.view()};
    return run_batch(*scene_.latest(), batch, {}).status();
  }
};

TEST_F(QueryTimesTest, EachQueryHasItsOwnTime) {
  const BlockResult result = run_block(*scene_.latest(), where({20, 25, 30}, {0.5f, 0.25f, 0}));
  EXPECT_EQ(xs(result), (std::vector<double>{20.5, 25.25, 30}));
  EXPECT_EQ(result.resolved_ticks, (std::vector<uint64_t>{20, 25, 30}));
  EXPECT_EQ(result.resolved_fractions, (std::vector<float>{0.5f, 0.25f, 0}));
  EXPECT_TRUE(result.clamped.empty());
}

TEST_F(QueryTimesTest, OneTimeServesAllQueriesAndIsReportedForEach) {
  OwnedBlock block = where({22});
  block.ids = {1, 1, 1};
  const BlockResult result = run_block(*scene_.latest(), block);
  EXPECT_EQ(xs(result), (std::vector<double>{22, 22, 22}));
  EXPECT_EQ(result.resolved_ticks, (std::vector<uint64_t>{22, 22, 22}));
}

TEST_F(QueryTimesTest, OneTickWithManyFractionsAreManyTimes) {
  OwnedBlock block = where({22});
  block.ids = {1, 1};
  block.as_of_fractions = {0, 0.5f};
  EXPECT_EQ(xs(run_block(*scene_.latest(), block)), (std::vector<double>{22, 22.5}));
}

TEST_F(QueryTimesTest, WithoutTimesNoneAreReported) {
  OwnedBlock block = where({22});
  block.as_of_ticks.clear();
  const BlockResult result = run_block(*scene_.latest(), block);
  EXPECT_EQ(xs(result), std::vector<double>{30});
  EXPECT_TRUE(result.resolved_ticks.empty());
  EXPECT_TRUE(result.resolved_fractions.empty());
}

TEST_F(QueryTimesTest, ATimeThatIsNotKeptRefusesTheBatchAndNamesTheRange) {
  const absl::Status status = refusal(where({25, 19}, {0, 0.75f}));
  expect_refusal(status, absl::StatusCode::kOutOfRange, Reason::kOutOfRange, "blocks[0].as_of_ticks", 1);
  EXPECT_NE(status.message().find("ticks 20 to 30"), absl::string_view::npos) << status;
  expect_refusal(refusal(where({31})), absl::StatusCode::kOutOfRange, Reason::kOutOfRange, "blocks[0].as_of_ticks", 0);
  expect_refusal(refusal(where({30}, {0.5f})), absl::StatusCode::kOutOfRange, Reason::kOutOfRange,
                 "blocks[0].as_of_ticks", 0);
}

TEST_F(QueryTimesTest, ClampingTakesTheNearestAndListsTheQuery) {
  OwnedBlock block = where({2, 25, 31}, {0.5f, 0.5f, 0.5f});
  block.settings.outside = OutsideHistory::kClamp;
  const BlockResult result = run_block(*scene_.latest(), block);
  EXPECT_EQ(xs(result), (std::vector<double>{20, 25.5, 30}));
  EXPECT_EQ(result.clamped, (std::vector<uint32_t>{0, 2}));
  EXPECT_EQ(result.resolved_fractions, (std::vector<float>{0, 0.5f, 0}));
}

TEST_F(QueryTimesTest, GroupsAreLookedUpAtEachTime) {
  OwnedBlock block = where({20, 20, 28, 20});
  block.ids.clear();
  block.groups = {4, 4, 4, 5};
  const BlockResult result = run_block(*scene_.latest(), block);
  EXPECT_EQ(result.counts, (std::vector<uint32_t>{1, 1, 1, 0}));
  EXPECT_EQ(xs(result), (std::vector<double>{20, 20, 28}));
}

TEST_F(QueryTimesTest, TheRoomForTimesIsPartOfTheReply) {
  OwnedBlock block = where({20});
  QueryBatch batch;
  batch.blocks = {block.view()};
  batch.max_reply_bytes = static_cast<uint32_t>(fixed_reply_bytes(batch));
  EXPECT_TRUE(check_batch(batch).ok());
  const uint64_t with_times = fixed_reply_bytes(batch);
  batch.blocks[0].as_of_ticks = {};
  EXPECT_LT(fixed_reply_bytes(batch), with_times);
}

}  // namespace
}  // namespace locus::test
