#include "core/query/kinds/lowest_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Hit row(Id id) {
  Hit hit;
  hit.id = id;
  return hit;
}

std::vector<std::pair<Id, uint32_t>> rows_of(const OverlapAnswer& answer) {
  std::vector<std::pair<Id, uint32_t>> rows;
  for (const RowRun& run : answer.runs) {
    if (run.triangle_count == 0) rows.emplace_back(run.row.id, kNoTriangle);
    for (const uint32_t triangle : answer.triangles_of(run)) rows.emplace_back(run.row.id, triangle);
  }
  return rows;
}

TEST(LowestRowsTest, RowsAscendById) {
  LowestRows rows(10, false);
  rows.offer(row(7), std::vector<uint32_t>{3, 1});
  rows.offer(row(2));
  rows.offer(row(5), std::vector<uint32_t>{9});
  const OverlapAnswer answer = rows.finish();
  EXPECT_THAT(rows_of(answer),
              ElementsAre(std::pair(2, kNoTriangle), std::pair(5, 9), std::pair(7, 3), std::pair(7, 1)));
  EXPECT_FALSE(answer.truncated);
}

TEST(LowestRowsTest, TrianglesOfAnInstanceKeepTheirOrderUnlessSorted) {
  for (const bool sorted : {false, true}) {
    LowestRows rows(10, sorted);
    rows.offer(row(7), std::vector<uint32_t>{3, 1});
    rows.offer(row(7), std::vector<uint32_t>{2});
    const std::vector<std::pair<Id, uint32_t>> found = rows_of(rows.finish());
    if (sorted)
      EXPECT_THAT(found, ElementsAre(std::pair(7, 1), std::pair(7, 2), std::pair(7, 3)));
    else
      EXPECT_THAT(found, ElementsAre(std::pair(7, 3), std::pair(7, 1), std::pair(7, 2)));
  }
}

TEST(LowestRowsTest, OnlyTheLowestAreKeptForAnyOrderOfOffers) {
  LowestRows rows(3, true);
  for (uint32_t triangle = 20; triangle > 0; --triangle) rows.offer(row(7), std::vector<uint32_t>{triangle});
  rows.offer(row(9), std::vector<uint32_t>{1, 2});
  rows.offer(row(3));
  const OverlapAnswer answer = rows.finish();
  EXPECT_THAT(rows_of(answer), ElementsAre(std::pair(3, kNoTriangle), std::pair(7, 1), std::pair(7, 2)));
  EXPECT_TRUE(answer.truncated);
}

TEST(LowestRowsTest, ExactlyMaxResultsRowsAreNotTruncated) {
  LowestRows rows(3, false);
  rows.offer(row(1), std::vector<uint32_t>{5, 6, 7});
  EXPECT_FALSE(rows.finish().truncated);
}

TEST(LowestRowsTest, WithoutOffersThereAreNoRows) {
  LowestRows rows(3, false);
  rows.offer(row(1), std::vector<uint32_t>());
  EXPECT_THAT(rows.finish().runs, IsEmpty());
}

}  // namespace
}  // namespace locus::test
