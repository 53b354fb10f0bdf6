// Tests of `locus bench` against a real server: tiny runs whose counts are checked, not their times.
#include <sstream>

#include "client/cli/run.h"
#include "tests/support/cli_test.h"

namespace locus::test {
namespace {

using cli::Json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class BenchTest : public CliTest {};

TEST_F(BenchTest, EveryKindIsMeasuredInASceneOfItsOwn) {
  const Json answer = json_of({"bench", "--seconds", "0.2", "--movers", "500", "--batch", "32", "--connections", "3"});
  EXPECT_EQ(answer["connections"], 3);
  EXPECT_EQ(answer["batch"], 32);
  EXPECT_EQ(answer["objects"], 500);
  std::vector<std::string> kinds;
  for (const Json& row : answer["kinds"]) {
    kinds.push_back(row["kind"]);
    EXPECT_GE(row["batches"], 3) << "each connection sends at least one";
    EXPECT_EQ(row["refused"], 0);
    if (row["kind"] == "moves") {
      EXPECT_GE(row["items"], 32);
    } else {
      EXPECT_EQ(row["items"], 32 * row["batches"].get<int>());
    }
    for (const char* key : {"rate_per_s", "p50_ms", "p99_ms", "p999_ms"}) EXPECT_TRUE(row[key].is_number()) << key;
    EXPECT_LE(row["p50_ms"], row["p99_ms"]);
    EXPECT_LE(row["p99_ms"], row["p999_ms"]);
  }
  EXPECT_THAT(kinds, ElementsAre("rays", "balls", "boxes", "nearest", "moves"));
  EXPECT_THAT(scenes(), ElementsAre("world")) << "its scene is deleted";
}

TEST_F(BenchTest, AnExistingSceneIsOnlyRead) {
  ASSERT_TRUE(apply(insert_balls(1, 50)).ok());
  const uint64_t revision = get("world").revision();
  const Json answer = json_of({"bench", "--scene", "world", "--seconds", "0.1", "--batch", "8"});
  EXPECT_EQ(answer["scene"], "world");
  EXPECT_EQ(answer["kinds"].size(), 4u);
  EXPECT_EQ(get("world").revision(), revision);
}

TEST_F(BenchTest, MistakesAreReported) {
  const Outcome moves = run({"bench", "--scene", "world", "--kinds", "rays,moves"});
  EXPECT_EQ(moves.code, cli::ExitCode::kUsage);
  EXPECT_THAT(moves.err, HasSubstr("leave moves out"));
  EXPECT_EQ(run({"bench", "--kinds", "cones"}).code, cli::ExitCode::kUsage);
  EXPECT_EQ(run({"bench", "--movers", "1", "--connections", "2"}).code, cli::ExitCode::kUsage);
  const Outcome empty = run({"bench", "--scene", "world", "--kinds", "rays"});
  EXPECT_EQ(empty.code, cli::ExitCode::kFailed);
  EXPECT_THAT(empty.err, HasSubstr("scene world is empty"));
  EXPECT_EQ(run({"bench", "--scene", "nowhere"}).code, cli::ExitCode::kNotFound);
}

}  // namespace
}  // namespace locus::test
