#include "client/lib/update_builder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::client {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(UpdateBuilderTest, RowsOfOneShapeShareOneInsertInTheOrderAdded) {
  const v1::UpdateBatch batch = UpdateBuilder()
                                    .insert_ball(7, Float3{1, 2, 3}, 0.5f)
                                    .insert_box(9, Float3{0, 0, 0}, {1, 2, 3})
                                    .insert_ball(8, Float3{4, 5, 6}, 0.25f)
                                    .build();
  ASSERT_EQ(batch.inserts_size(), 2);
  EXPECT_THAT(batch.inserts(0).ids(), ElementsAre(7, 8));
  EXPECT_THAT(batch.inserts(0).positions(), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(batch.inserts(0).ball().radii(), ElementsAre(0.5f, 0.25f));
  EXPECT_THAT(batch.inserts(1).box().half_extents(), ElementsAre(1, 2, 3));
}

TEST(UpdateBuilderTest, ColumnsOfDefaultValuesStayEmpty) {
  const v1::UpdateBatch batch = UpdateBuilder().insert_box(9, Float3{0, 0, 0}, {1, 1, 1}).build();
  const v1::Insert& insert = batch.inserts(0);
  EXPECT_THAT(insert.rotations(), IsEmpty());
  EXPECT_THAT(insert.layers(), IsEmpty());
  EXPECT_THAT(insert.groups(), IsEmpty());
  EXPECT_THAT(insert.tags(), IsEmpty());
}

TEST(UpdateBuilderTest, AColumnThatStartsLateIsFilledWithDefaultsBefore) {
  const v1::UpdateBatch batch =
      UpdateBuilder()
          .insert_box(1, Float3{}, {1, 1, 1})
          .insert_box(2, Float3{}, {1, 1, 1}, {0, 0, 1, 0}, {.layers = 6, .group = 3, .tag = 4})
          .insert_box(3, Float3{}, {1, 1, 1})
          .build();
  const v1::Insert& insert = batch.inserts(0);
  EXPECT_THAT(insert.rotations(), ElementsAre(0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1));
  EXPECT_THAT(insert.layers(), ElementsAre(1, 6, 1));
  EXPECT_THAT(insert.groups(), ElementsAre(0, 3, 0));
  EXPECT_THAT(insert.tags(), ElementsAre(0, 4, 0));
}

TEST(UpdateBuilderTest, AbsolutePositionsGoIntoTheirOwnInsertInDouble) {
  const v1::UpdateBatch batch =
      UpdateBuilder().insert_point(1, Float3{1, 1, 1}).insert_point(2, Double3{0.1, 1e9, 3}).build();
  ASSERT_EQ(batch.inserts_size(), 2);
  EXPECT_TRUE(batch.inserts(1).has_point());
  EXPECT_THAT(batch.inserts(1).positions(), IsEmpty());
  EXPECT_THAT(batch.inserts(1).positions_f64(), ElementsAre(0.1, 1e9, 3));
}

TEST(UpdateBuilderTest, CapsulesHaveAxisAndRadius) {
  const v1::UpdateBatch batch = UpdateBuilder().insert_capsule(5, Float3{1, 2, 3}, {0, 0.5f, 0}, 0.25f).build();
  EXPECT_THAT(batch.inserts(0).capsule().half_axes(), ElementsAre(0, 0.5f, 0));
  EXPECT_THAT(batch.inserts(0).capsule().radii(), ElementsAre(0.25f));
}

TEST(UpdateBuilderTest, LifetimesAreAColumnOfTheirOwn) {
  const std::vector<uint64_t> ids = {3, 4}, expire = {9};
  const std::vector<float> positions = {1, 2, 3};
  const v1::UpdateBatch batch = UpdateBuilder()
                                    .insert_point(1, Float3{})
                                    .insert_point(2, Float3{}, {.expire_ticks = 30})
                                    .insert_points({.ids = ids, .positions = positions, .expire_ticks = expire})
                                    .build();
  EXPECT_THAT(batch.inserts(0).expire_ticks(), ElementsAre(0, 30));
  EXPECT_THAT(batch.inserts(1).expire_ticks(), ElementsAre(9));
}

TEST(UpdateBuilderTest, PartsOfACompoundAreNumberedInTheOrderAdded) {
  const Compound rig = Compound()
                           .ball({0, 0, 2}, 0.5f)
                           .ball({0, 0, 3}, 0.25f, {.layers = 4})
                           .capsule({1, 0, 0}, {0, 0, 1}, 0.125f)
                           .box({0, 0, 1}, {1, 2, 3}, {.rotation = {0, 0, 1, 0}})
                           .ball({0, 0, 4}, 1);
  EXPECT_EQ(rig.size(), 5u);
  const v1::Compound& message = rig.message();
  ASSERT_EQ(message.parts_size(), 4) << "parts of one shape share an entry only if no other part is between them";
  EXPECT_THAT(message.parts(0).positions(), ElementsAre(0, 0, 2, 0, 0, 3));
  EXPECT_THAT(message.parts(0).ball().radii(), ElementsAre(0.5f, 0.25f));
  EXPECT_THAT(message.parts(0).layers(), ElementsAre(kAllLayers, 4));
  EXPECT_THAT(message.parts(0).rotations(), IsEmpty());
  EXPECT_THAT(message.parts(1).capsule().half_axes(), ElementsAre(0, 0, 1));
  EXPECT_THAT(message.parts(1).capsule().radii(), ElementsAre(0.125f));
  EXPECT_THAT(message.parts(2).box().half_extents(), ElementsAre(1, 2, 3));
  EXPECT_THAT(message.parts(2).rotations(), ElementsAre(0, 0, 1, 0));
  EXPECT_THAT(message.parts(2).layers(), IsEmpty());
  EXPECT_THAT(message.parts(3).ball().radii(), ElementsAre(1));
}

TEST(UpdateBuilderTest, CompoundsWithEqualPartsShareOneInsert) {
  const Compound rig = Compound().ball({0, 0, 1}, 1, {.layers = 2});
  const Compound car = Compound().box({0, 0, 1}, {2, 1, 1});
  const v1::UpdateBatch batch = UpdateBuilder()
                                    .insert_compound(1, Float3{1, 0, 0}, rig)
                                    .insert_compound(2, Float3{2, 0, 0}, Compound(rig), {0, 0, 1, 0}, {.group = 7})
                                    .insert_compound(3, Float3{3, 0, 0}, car, {}, {.layers = 1})
                                    .insert_compound(4, Float3{4, 0, 0}, car, {}, {.layers = 8, .expire_ticks = 5})
                                    .insert_compound(5, Float3{5, 0, 0}, car)
                                    .insert_compound(6, Double3{6, 0, 0}, rig)
                                    .build();
  ASSERT_EQ(batch.inserts_size(), 4);
  EXPECT_THAT(batch.inserts(0).ids(), ElementsAre(1, 2));
  EXPECT_THAT(batch.inserts(0).rotations(), ElementsAre(0, 0, 0, 1, 0, 0, 1, 0));
  EXPECT_THAT(batch.inserts(0).groups(), ElementsAre(0, 7));
  EXPECT_THAT(batch.inserts(0).layers(), IsEmpty()) << "none = all layers of the parts";
  EXPECT_THAT(batch.inserts(0).compound().parts(0).layers(), ElementsAre(2));
  EXPECT_THAT(batch.inserts(1).ids(), ElementsAre(3, 4));
  EXPECT_THAT(batch.inserts(1).layers(), ElementsAre(1, 8)) << "a given value is sent, even if it is 1";
  EXPECT_THAT(batch.inserts(1).expire_ticks(), ElementsAre(0, 5));
  EXPECT_THAT(batch.inserts(2).ids(), ElementsAre(5));
  EXPECT_THAT(batch.inserts(2).layers(), IsEmpty());
  EXPECT_THAT(batch.inserts(3).positions_f64(), ElementsAre(6, 0, 0));
}

TEST(UpdateBuilderTest, CompoundsInColumnsHaveTheSameParts) {
  const std::vector<uint64_t> ids = {1, 2};
  const std::vector<float> positions = {1, 2, 3, 4, 5, 6};
  const Compound rig = Compound().ball({}, 1).capsule({}, {0, 0, 1}, 1);
  const v1::UpdateBatch batch = UpdateBuilder().insert_compounds({.ids = ids, .positions = positions}, rig).build();
  EXPECT_THAT(batch.inserts(0).ids(), ElementsAre(1, 2));
  EXPECT_EQ(batch.inserts(0).compound().parts_size(), 2);
}

TEST(UpdateBuilderTest, MovesOfCompoundsCarryThePosesOfTheirParts) {
  const std::vector<PartPose> bent = {{{0, 0, 1}}, {{0, 0, 2}, {0, 0, 1, 0}}};
  const std::vector<PartPose> single = {{{1, 2, 3}}};
  const std::vector<uint64_t> ids = {6, 7};
  const std::vector<float> positions = {1, 2, 3}, part_positions = {0, 0, 1, 0, 0, 2};
  const v1::UpdateBatch batch =
      UpdateBuilder()
          .move_compound(1, Float3{1, 0, 0}, bent)
          .move_compound(2, Float3{2, 0, 0}, bent)
          .move_compound(3, Float3{3, 0, 0}, single)
          .move(4, Float3{4, 0, 0})
          .moves({.ids = ids, .positions = positions, .parts_each = 2, .part_positions = part_positions})
          .build();
  ASSERT_EQ(batch.moves_size(), 4);
  EXPECT_THAT(batch.moves(0).ids(), ElementsAre(1, 2));
  EXPECT_EQ(batch.moves(0).parts_each(), 2u);
  EXPECT_THAT(batch.moves(0).part_positions(), ElementsAre(0, 0, 1, 0, 0, 2, 0, 0, 1, 0, 0, 2));
  EXPECT_THAT(batch.moves(0).part_rotations(), ElementsAre(0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 1, 0));
  EXPECT_EQ(batch.moves(1).parts_each(), 1u);
  EXPECT_EQ(batch.moves(2).parts_each(), 0u);
  EXPECT_THAT(batch.moves(2).part_positions(), IsEmpty());
  EXPECT_EQ(batch.moves(3).parts_each(), 2u);
  EXPECT_THAT(batch.moves(3).part_positions(), ElementsAre(0, 0, 1, 0, 0, 2));
  EXPECT_THAT(batch.moves(3).part_rotations(), IsEmpty()) << "absent keeps the rotations of the parts";
}

TEST(UpdateBuilderTest, WholeColumnsAreCopiedUnchanged) {
  const std::vector<uint64_t> ids = {1, 2};
  const std::vector<float> positions = {1, 2, 3, 4, 5, 6};
  const std::vector<uint32_t> one_for_all = {4};
  const std::vector<float> radii = {0.5f};
  const v1::UpdateBatch batch = UpdateBuilder()
                                    .insert_ball(9, Float3{}, 1)
                                    .insert_balls({.ids = ids, .positions = positions, .layers = one_for_all}, radii)
                                    .insert_ball(10, Float3{}, 1)
                                    .build();
  ASSERT_EQ(batch.inserts_size(), 2) << "rows are not added to columns that may have one entry for all";
  EXPECT_THAT(batch.inserts(0).ids(), ElementsAre(9, 10));
  EXPECT_THAT(batch.inserts(1).ids(), ElementsAre(1, 2));
  EXPECT_THAT(batch.inserts(1).positions(), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(batch.inserts(1).layers(), ElementsAre(4));
  EXPECT_THAT(batch.inserts(1).ball().radii(), ElementsAre(0.5f));
}

TEST(UpdateBuilderTest, MovesKeepTheirOrderAcrossForms) {
  const v1::UpdateBatch batch = UpdateBuilder()
                                    .move(1, Float3{1, 0, 0})
                                    .move(2, Float3{2, 0, 0})
                                    .move(1, Float3{3, 0, 0}, Rotation{})
                                    .move(1, Float3{4, 0, 0})
                                    .move(1, Double3{5, 0, 0})
                                    .move(1, Double3{6, 0, 0}, std::nullopt, MoveKind::kTeleport)
                                    .build();
  ASSERT_EQ(batch.moves_size(), 5);
  EXPECT_THAT(batch.moves(0).ids(), ElementsAre(1, 2));
  EXPECT_THAT(batch.moves(0).rotations(), IsEmpty()) << "absent keeps the object's rotation";
  EXPECT_THAT(batch.moves(1).rotations(), ElementsAre(0, 0, 0, 1));
  EXPECT_THAT(batch.moves(2).positions(), ElementsAre(4, 0, 0));
  EXPECT_THAT(batch.moves(3).positions_f64(), ElementsAre(5, 0, 0));
  EXPECT_TRUE(batch.moves(4).teleport());
}

TEST(UpdateBuilderTest, RowsNeverExtendAWholeColumnOfMoves) {
  const std::vector<uint64_t> ids = {1, 2};
  const std::vector<float> one_for_all = {0, 0, 0};
  const v1::UpdateBatch batch =
      UpdateBuilder().moves({.ids = ids, .positions = one_for_all}).move(3, Float3{1, 1, 1}).build();
  ASSERT_EQ(batch.moves_size(), 2);
  EXPECT_THAT(batch.moves(0).positions(), ElementsAre(0, 0, 0));
  EXPECT_THAT(batch.moves(1).ids(), ElementsAre(3));
}

TEST(UpdateBuilderTest, RelabelsLeaveAbsentColumnsEmpty) {
  const v1::UpdateBatch batch =
      UpdateBuilder().relabel(1, {.layers = 0u}).relabel(2, {.layers = 2u}).relabel(3, {.tag = 5u}).build();
  ASSERT_EQ(batch.relabels_size(), 2);
  EXPECT_THAT(batch.relabels(0).ids(), ElementsAre(1, 2));
  EXPECT_THAT(batch.relabels(0).layers(), ElementsAre(0, 2));
  EXPECT_THAT(batch.relabels(0).groups(), IsEmpty());
  EXPECT_THAT(batch.relabels(1).tags(), ElementsAre(5));
}

TEST(UpdateBuilderTest, MovesOfInstancesShareAMessageWhileTheirColumnsAreTheSame) {
  const std::vector<uint64_t> ids = {8, 9};
  const std::vector<double> positions = {1, 2, 3};
  const std::vector<float> scales = {2};
  const v1::UpdateBatch batch = UpdateBuilder()
                                    .move_instance(1, Double3{1, 2, 3})
                                    .move_instance(2, Double3{4, 5, 6})
                                    .move_instance(3, Double3{7, 8, 9}, Rotation{0, 0, 1, 0}, 2.0f)
                                    .move_instance(4, Float3{1, 1, 1}, std::nullopt, std::nullopt, MoveKind::kTeleport)
                                    .move_instances({.ids = ids, .positions_f64 = positions, .scales = scales})
                                    .move_instance(5, Double3{1, 2, 3})
                                    .build();
  ASSERT_EQ(batch.instance_moves_size(), 5);
  EXPECT_THAT(batch.instance_moves(0).ids(), ElementsAre(1, 2));
  EXPECT_THAT(batch.instance_moves(0).positions_f64(), ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(batch.instance_moves(0).rotations(), IsEmpty());
  EXPECT_THAT(batch.instance_moves(1).rotations(), ElementsAre(0, 0, 1, 0));
  EXPECT_THAT(batch.instance_moves(1).scales(), ElementsAre(2));
  EXPECT_THAT(batch.instance_moves(2).positions(), ElementsAre(1, 1, 1));
  EXPECT_TRUE(batch.instance_moves(2).teleport());
  EXPECT_THAT(batch.instance_moves(3).ids(), ElementsAre(8, 9));
  EXPECT_THAT(batch.instance_moves(4).ids(), ElementsAre(5));
  EXPECT_EQ(batch.moves_size(), 0);
}

TEST(UpdateBuilderTest, RelabelsOfInstancesAreApartFromThoseOfObjects) {
  const v1::UpdateBatch batch = UpdateBuilder()
                                    .relabel(1, {.tag = 5u})
                                    .relabel_instance(2, {.layers = 0u})
                                    .relabel_instance(3, {.layers = 1u})
                                    .build();
  EXPECT_THAT(batch.relabels(0).ids(), ElementsAre(1));
  ASSERT_EQ(batch.instance_relabels_size(), 1);
  EXPECT_THAT(batch.instance_relabels(0).ids(), ElementsAre(2, 3));
  EXPECT_THAT(batch.instance_relabels(0).layers(), ElementsAre(0, 1));
}

TEST(UpdateBuilderTest, SettingsAndRemovesAreInTheBatchAndBuildResetsTheBuilder) {
  UpdateBuilder builder;
  const std::vector<uint64_t> more = {2, 3};
  const v1::UpdateBatch batch = builder.frame({1, 2, 3})
                                    .tick(0)
                                    .upsert()
                                    .all_or_nothing()
                                    .restart_ticks()
                                    .clear()
                                    .remove(1)
                                    .remove(more)
                                    .remove_group(8)
                                    .insert_point(4, Float3{})
                                    .build();
  EXPECT_EQ(batch.frame().z(), 3);
  EXPECT_TRUE(batch.has_tick());
  EXPECT_TRUE(batch.upsert() && batch.all_or_nothing() && batch.restart_ticks() && batch.clear());
  EXPECT_THAT(batch.remove_ids(), ElementsAre(1, 2, 3));
  EXPECT_THAT(batch.remove_groups(), ElementsAre(8));
  EXPECT_EQ(builder.build().ByteSizeLong(), 0u);
  EXPECT_EQ(builder.insert_point(4, Float3{}).build().inserts_size(), 1);
}

}  // namespace
}  // namespace locus::client
