#include "server/convert/result_columns.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/run_batch.h"

namespace locus::server {
namespace {

using ::testing::ElementsAreArray;

constexpr size_t kRows = 5;

// Writes the numbers `first`, `first` + 1, ... into the `entries` entries of `column`.
template <class T>
void count_up(T* column, size_t entries, uint32_t first = 1) {
  for (size_t i = 0; i < entries; ++i) column[i] = static_cast<T>(first + i);
}

ColumnSet every_column() {
  ColumnSet columns;
  for (uint8_t number = 1; number < v1::Column_ARRAYSIZE; ++number) columns.add(static_cast<Column>(number));
  return columns;
}

void fill(AnswerSink& sink) {
  for (int round = 0; round < 2; ++round) {  // the second round makes columns grow
    const RowSpans to = sink.add_rows(1, every_column(), kRows);
    count_up(to.t, kRows);
    count_up(to.ids, kRows, 2);
    count_up(to.triangles, kRows, 3);
    count_up(to.uvs, 2 * kRows, 4);
    count_up(to.normals, 3 * kRows, 5);
    count_up(to.points, 3 * kRows, 6);
    count_up(to.groups, kRows, 7);
    count_up(to.tags, kRows, 8);
    count_up(to.layers, kRows, 9);
    count_up(to.positions, 3 * kRows, 10);
    count_up(to.rotations, 4 * kRows, 11);
    count_up(to.shapes, kRows, 18);
    count_up(to.sizes, 4 * kRows, 19);
    count_up(sink.add_counts(1, kRows), kRows, 12);
    count_up(sink.add_truncated(1, 2), 2, 13);
    count_up(sink.add_hits(1, kRows), kRows, 14);
    const TimeSpans moments = sink.add_times(1, kRows);
    count_up(moments.ticks, kRows, 15);
    count_up(moments.fractions, kRows, 16);
    count_up(sink.add_clamped(1, 3), 3, 17);
  }
}

TEST(ResultColumnsTest, EachColumnIsWrittenToItsProtocolField) {
  test::BatchResult through_core;
  through_core.blocks.resize(2);
  test::BatchResultSink core_sink(through_core);
  fill(core_sink);
  v1::QueryResult result;
  ResultColumns sink(result, 2);
  fill(sink);
  const test::BlockResult& expected = through_core.blocks[1];
  const v1::BlockResult& block = result.blocks(1);
  EXPECT_THAT(block.counts(), ElementsAreArray(expected.counts));
  EXPECT_THAT(block.truncated(), ElementsAreArray(expected.truncated));
  EXPECT_THAT(block.t(), ElementsAreArray(expected.t));
  EXPECT_THAT(block.ids(), ElementsAreArray(expected.ids));
  EXPECT_THAT(block.triangles(), ElementsAreArray(expected.triangles));
  EXPECT_THAT(block.uvs(), ElementsAreArray(expected.uvs));
  EXPECT_THAT(block.normals(), ElementsAreArray(expected.normals));
  EXPECT_THAT(block.points(), ElementsAreArray(expected.points));
  EXPECT_THAT(block.groups(), ElementsAreArray(expected.groups));
  EXPECT_THAT(block.tags(), ElementsAreArray(expected.tags));
  EXPECT_THAT(block.layers(), ElementsAreArray(expected.layers));
  EXPECT_THAT(block.positions(), ElementsAreArray(expected.positions));
  EXPECT_THAT(block.rotations(), ElementsAreArray(expected.rotations));
  EXPECT_THAT(block.shapes(), ElementsAreArray(expected.shapes));
  EXPECT_THAT(block.sizes(), ElementsAreArray(expected.sizes));
  EXPECT_THAT(block.resolved_ticks(), ElementsAreArray(expected.resolved_ticks));
  EXPECT_THAT(block.resolved_fractions(), ElementsAreArray(expected.resolved_fractions));
  EXPECT_THAT(block.clamped(), ElementsAreArray(expected.clamped));
  EXPECT_EQ(block.hits(), expected.hits);
  EXPECT_EQ(result.blocks(0).SerializeAsString(), "") << "the other block is untouched";
}

TEST(ResultColumnsTest, ColumnsThatAreNotRequestedAreNull) {
  v1::QueryResult result;
  ResultColumns sink(result, 1);
  const RowSpans to = sink.add_rows(0, {Column::kId}, 3);
  EXPECT_NE(to.ids, nullptr);
  EXPECT_EQ(to.t, nullptr);
  EXPECT_EQ(to.rotations, nullptr);
  EXPECT_EQ(result.blocks(0).t_size(), 0);
}

TEST(ResultColumnsTest, AReusedReplyDropsTheLastAnswerAndKeepsItsMemory) {
  v1::QueryResult result;
  const float* before = nullptr;
  {
    ResultColumns sink(result, 2);
    before = sink.add_rows(0, {Column::kT}, 100).t;
  }
  ResultColumns sink(result, 1);
  EXPECT_EQ(result.blocks_size(), 1);
  EXPECT_EQ(result.blocks(0).t_size(), 0);
  EXPECT_EQ(sink.add_rows(0, {Column::kT}, 100).t, before);
}

}  // namespace
}  // namespace locus::server
