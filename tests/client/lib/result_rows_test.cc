#include "client/lib/result_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>

namespace locus::client {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

v1::BlockResult first_hits() {
  v1::BlockResult block;
  for (const float t : {2.5f, std::numeric_limits<float>::infinity()}) block.add_t(t);
  for (const uint64_t id : {7, 0}) block.add_ids(id);
  for (const uint32_t triangle : {3u, kNoTriangle}) block.add_triangles(triangle);
  return block;
}

v1::BlockResult overlaps_of_three() {
  v1::BlockResult block;
  for (const uint32_t count : {2, 0, 1}) block.add_counts(count);
  for (const uint64_t id : {4, 9, 4}) block.add_ids(id);
  block.add_truncated(2);
  return block;
}

TEST(ResultRowsTest, EffectiveTimesAndClampedQueriesAreReportedByQuery) {
  v1::BlockResult block = first_hits();
  for (const uint64_t tick : {5, 9}) block.add_resolved_ticks(tick);
  for (const float fraction : {0.5f, 0.0f}) block.add_resolved_fractions(fraction);
  block.add_clamped(1);
  const absl::StatusOr<ResultRows> rows = ResultRows::of(block);
  ASSERT_TRUE(rows.ok()) << rows.status();
  EXPECT_THAT(rows->resolved_ticks(), ElementsAre(5, 9));
  EXPECT_THAT(rows->resolved_fractions(), ElementsAre(0.5f, 0.0f));
  EXPECT_FALSE(rows->clamped(0));
  EXPECT_TRUE(rows->clamped(1));
}

// Adds `count` zeros to a repeated number field.
void add_zeros(v1::BlockResult& block, const google::protobuf::FieldDescriptor& field, int count) {
  const google::protobuf::Reflection& reflection = *block.GetReflection();
  for (int i = 0; i < count; ++i) {
    switch (field.cpp_type()) {
      case google::protobuf::FieldDescriptor::CPPTYPE_FLOAT:
        reflection.AddFloat(&block, &field, 0);
        break;
      case google::protobuf::FieldDescriptor::CPPTYPE_DOUBLE:
        reflection.AddDouble(&block, &field, 0);
        break;
      case google::protobuf::FieldDescriptor::CPPTYPE_UINT32:
        reflection.AddUInt32(&block, &field, 0);
        break;
      default:
        reflection.AddUInt64(&block, &field, 0);
    }
  }
}

// A new result column of the protocol fails this test until ResultRows checks its length.
TEST(ResultRowsTest, TheLengthOfEveryColumnIsChecked) {
  const std::set<std::string> not_by_row = {"counts",  "truncated", "resolved_ticks", "resolved_fractions",
                                            "clamped", "unanchored"};
  const google::protobuf::Descriptor& type = *v1::BlockResult::descriptor();
  int columns = 0;
  for (int i = 0; i < type.field_count(); ++i) {
    const google::protobuf::FieldDescriptor& field = *type.field(i);
    if (!field.is_repeated() || not_by_row.count(field.name()) > 0) continue;
    ++columns;
    v1::BlockResult block;
    block.add_counts(2);
    add_zeros(block, field, 11);  // no column has 11 entries for two rows
    EXPECT_TRUE(absl::IsDataLoss(ResultRows::of(block).status())) << field.name();
  }
  EXPECT_GE(columns, 12);
}

TEST(RayHitsTest, FirstHasOneRowPerRayAndReportsMisses) {
  const v1::BlockResult block = first_hits();
  const absl::StatusOr<RayHits> hits = RayHits::of(block);
  ASSERT_TRUE(hits.ok()) << hits.status();
  ASSERT_EQ(hits->size(), 2u);
  EXPECT_TRUE(hits->hit(0));
  EXPECT_EQ(hits->t(0), 2.5f);
  EXPECT_EQ(hits->id(0), 7u);
  EXPECT_EQ(hits->triangle(0), 3u);
  EXPECT_FALSE(hits->hit(1));
  EXPECT_TRUE(std::isinf(hits->t(1)));
  EXPECT_EQ(hits->triangle(1), kNoTriangle);
}

TEST(RayHitsTest, AllGivesTheNearestHitOfEachRayAndAMissForRaysWithoutRows) {
  v1::BlockResult block;
  for (const uint32_t count : {0, 2}) block.add_counts(count);
  for (const float t : {1.0f, 2.0f}) block.add_t(t);
  for (const uint64_t id : {5, 6}) block.add_ids(id);
  const absl::StatusOr<RayHits> hits = RayHits::of(block);
  ASSERT_TRUE(hits.ok()) << hits.status();
  EXPECT_FALSE(hits->hit(0));
  EXPECT_TRUE(std::isinf(hits->t(0)));
  EXPECT_EQ(hits->id(1), 5u);
  EXPECT_EQ(hits->rows().rows_of(1).size(), 2u);
  EXPECT_EQ(hits->triangle(1), kNoTriangle) << "the column was not requested";
}

TEST(RayHitsTest, MissingColumnsAreAnError) {
  v1::BlockResult block = first_hits();
  block.clear_t();
  EXPECT_EQ(RayHits::of(block).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(AnyHitsTest, AnyHasOneBytePerRay) {
  v1::BlockResult block;
  block.set_hits(std::string("\1\0\1", 3));
  const absl::StatusOr<AnyHits> hits = AnyHits::of(block);
  ASSERT_TRUE(hits.ok());
  ASSERT_EQ(hits->size(), 3u);
  EXPECT_TRUE(hits->hit(0));
  EXPECT_FALSE(hits->hit(1));
  EXPECT_TRUE(hits->hit(2));
  EXPECT_EQ(AnyHits::of(first_hits()).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(OverlapsTest, EachQueryHasItsOwnSpanOfIds) {
  const v1::BlockResult block = overlaps_of_three();
  const absl::StatusOr<Overlaps> overlaps = Overlaps::of(block);
  ASSERT_TRUE(overlaps.ok()) << overlaps.status();
  ASSERT_EQ(overlaps->size(), 3u);
  EXPECT_THAT(overlaps->ids(0), ElementsAre(4, 9));
  EXPECT_THAT(overlaps->ids(1), IsEmpty());
  EXPECT_THAT(overlaps->ids(2), ElementsAre(4));
  EXPECT_THAT(overlaps->triangles(0), IsEmpty());
  EXPECT_FALSE(overlaps->rows().truncated(0));
  EXPECT_TRUE(overlaps->rows().truncated(2));
}

TEST(OverlapsTest, TriangleRowsAreAsLongAsIds) {
  v1::BlockResult block = overlaps_of_three();
  for (const uint32_t triangle : {10u, 11u, kNoTriangle}) block.add_triangles(triangle);
  const absl::StatusOr<Overlaps> overlaps = Overlaps::of(block);
  ASSERT_TRUE(overlaps.ok());
  EXPECT_THAT(overlaps->triangles(0), ElementsAre(10, 11));
  EXPECT_THAT(overlaps->triangles(2), ElementsAre(kNoTriangle));
}

TEST(ResultRowsTest, AColumnWhoseLengthContradictsTheCountsIsDataLoss) {
  v1::BlockResult block = overlaps_of_three();
  block.add_counts(5);
  EXPECT_EQ(ResultRows::of(block).status().code(), absl::StatusCode::kDataLoss);
  v1::BlockResult uneven = first_hits();
  uneven.add_normals(1);
  EXPECT_EQ(ResultRows::of(uneven).status().code(), absl::StatusCode::kDataLoss);
}

TEST(ResultRowsTest, AnEmptyBlockHasNoQueries) {
  const v1::BlockResult block;
  const absl::StatusOr<ResultRows> rows = ResultRows::of(block);
  ASSERT_TRUE(rows.ok());
  EXPECT_EQ(rows->queries(), 0u);
  EXPECT_EQ(rows->rows(), 0u);
}

}  // namespace
}  // namespace locus::client
