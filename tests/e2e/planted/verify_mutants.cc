// `locus verify` against servers with a planted bug in a structure: it finds each bug by itself, and names the query.
#include "core/base/planted_bug.h"
#include "tests/support/cli_outcome.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;

// No more than verify asks about pairs of.
constexpr uint64_t kObjects = 300;

struct Planted {
  const char* name;
  PlantedBug bug;
};

class PlantedVerifyTest : public RpcTest, public ::testing::WithParamInterface<Planted> {
 protected:
  // The bug is planted while the server waits for calls: it is read only by calls that follow.
  void TearDown() override { planted_bug = PlantedBug::kNone; }

  Outcome verify() {
    run({"generate", "city", "--triangles", "2000", "--seed", "1", "--scene", "world"});
    v1::UpdateBatch batch;
    v1::Insert* insert = batch.add_inserts();
    for (uint64_t id = 1; id <= kObjects; ++id) {
      const auto n = static_cast<double>(id);
      insert->add_ids(id);
      for (const double at : {4 * n - 600, static_cast<double>(id % 7), static_cast<double>(id % 40) - 20})
        insert->add_positions_f64(at);
    }
    insert->mutable_ball()->add_radii(1.5f);
    EXPECT_TRUE(apply(batch).ok());
    planted_bug = GetParam().bug;
    return run({"verify", "world", "--seconds", "30", "--seed", "1"});
  }

 private:
  Outcome run(const std::vector<std::string>& line) { return run_cli(running_.address(), line); }
};

TEST_P(PlantedVerifyTest, IsFound) {
  const Outcome outcome = verify();
  EXPECT_EQ(outcome.code, cli::ExitCode::kFailed) << outcome.out;
  EXPECT_THAT(outcome.err, HasSubstr("the answers differ at revision"));
  EXPECT_THAT(outcome.err, HasSubstr("query "));
}

INSTANTIATE_TEST_SUITE_P(Known, PlantedVerifyTest,
                         ::testing::Values(Planted{"DroppedCells", PlantedBug::kDropCell},
                                           Planted{"CrossingsThatEndEarly", PlantedBug::kWayShort},
                                           Planted{"CulledPairs", PlantedBug::kPairCullExtent}),
                         [](const auto& trial) { return trial.param.name; });

}  // namespace
}  // namespace locus::test
