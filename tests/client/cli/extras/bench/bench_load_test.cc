#include "client/cli/extras/bench/bench_load.h"

#include <gtest/gtest.h>

namespace locus::cli {
namespace {

BenchLoad load_of(BenchKind kind) {
  BenchLoad load;
  load.kind = kind;
  load.bounds = {{100, 200, 300}, {110, 220, 330}};
  load.batch = 7;
  return load;
}

TEST(BenchLoadTest, PercentilesAreValuesOfTheSample) {
  EXPECT_EQ(percentile({}, 0.5), 0);
  EXPECT_EQ(percentile({3}, 0.999), 3);
  std::vector<double> values;
  for (int i = 1000; i >= 1; --i) values.push_back(i);
  EXPECT_EQ(percentile(values, 0.5), 500);
  EXPECT_EQ(percentile(values, 0.99), 990);
  EXPECT_EQ(percentile(values, 0.999), 999);
  EXPECT_EQ(percentile(values, 1), 1000);
}

TEST(BenchLoadTest, ABatchHasTheRequestedQueries) {
  DemoRandom random(1);
  EXPECT_EQ(bench_queries(load_of(BenchKind::kRays), random).blocks(0).rays().origins_size(), 21);
  EXPECT_EQ(bench_queries(load_of(BenchKind::kBalls), random).blocks(0).balls().radii_size(), 7);
  EXPECT_EQ(bench_queries(load_of(BenchKind::kBoxes), random).blocks(0).boxes().half_extents_size(), 21);
  EXPECT_EQ(bench_queries(load_of(BenchKind::kNearest), random).blocks(0).nearest().points_size(), 21);
}

TEST(BenchLoadTest, ObjectsStayInsideTheBounds) {
  DemoRandom random(1);
  const BenchLoad load = load_of(BenchKind::kMoves);
  const v1::UpdateBatch inserts = bench_inserts(load, 5, 100, random);
  ASSERT_EQ(inserts.inserts_size(), 1);
  EXPECT_EQ(inserts.inserts(0).ids(0), 5u);
  const v1::UpdateBatch moves = bench_moves(load, 5, 100, random);
  ASSERT_EQ(moves.moves_size(), 1);
  ASSERT_EQ(moves.moves(0).ids_size(), 100);
  EXPECT_EQ(moves.moves(0).ids(99), 104u);
  for (const auto& positions : {inserts.inserts(0).positions_f64(), moves.moves(0).positions_f64()}) {
    ASSERT_EQ(positions.size(), 300);
    for (int i = 0; i < positions.size(); i += 3) {
      EXPECT_TRUE(positions[i] >= 100 && positions[i] <= 110) << positions[i];
      EXPECT_TRUE(positions[i + 1] >= 200 && positions[i + 1] <= 220) << positions[i + 1];
      EXPECT_TRUE(positions[i + 2] >= 300 && positions[i + 2] <= 330) << positions[i + 2];
    }
  }
}

}  // namespace
}  // namespace locus::cli
