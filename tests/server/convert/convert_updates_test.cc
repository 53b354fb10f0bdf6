#include <gtest/gtest.h>

#include "core/base/refusal.h"
#include "server/convert/convert.h"

namespace locus::server {
namespace {

TEST(ConvertUpdatesTest, EveryFieldOfABatchArrives) {
  v1::UpdateBatch batch;
  batch.mutable_frame()->set_y(2);
  batch.set_tick(0);
  batch.set_clear(true);
  batch.add_remove_ids(3);
  batch.add_remove_groups(4);
  v1::Insert* insert = batch.add_inserts();
  insert->add_ids(5);
  for (int i = 0; i < 3; ++i) insert->add_positions_f64(i);
  insert->mutable_capsule()->add_radii(0.5f);
  for (int i = 0; i < 3; ++i) insert->mutable_capsule()->add_half_axes(static_cast<float>(i));
  insert->add_layers(6);
  insert->add_groups(7);
  insert->add_tags(8);
  insert->add_expire_ticks(30);
  v1::Move* move = batch.add_moves();
  move->add_ids(9);
  for (int i = 0; i < 3; ++i) move->add_positions(static_cast<float>(i));
  for (int i = 0; i < 4; ++i) move->add_rotations(0.5f);
  move->set_teleport(true);
  batch.add_relabels()->add_ids(10);
  v1::InstanceMove* instance_move = batch.add_instance_moves();
  instance_move->add_ids(20);
  for (int i = 0; i < 3; ++i) instance_move->add_positions_f64(i);
  for (int i = 0; i < 4; ++i) instance_move->add_rotations(0.5f);
  instance_move->add_scales(2);
  instance_move->set_teleport(true);
  batch.add_instance_relabels()->add_ids(21);
  batch.mutable_instance_relabels(0)->add_layers(0);
  batch.set_upsert(true);
  batch.set_all_or_nothing(true);
  batch.set_restart_ticks(true);
  batch.set_writer(11);
  batch.set_batch(12);
  const absl::StatusOr<UpdateBatch> updates = to_updates(batch);
  ASSERT_TRUE(updates.ok()) << updates.status();
  EXPECT_EQ(updates->frame, (Vec3d{0, 2, 0}));
  EXPECT_EQ(updates->tick, std::optional<uint64_t>(0));
  EXPECT_TRUE(updates->clear && updates->upsert && updates->all_or_nothing && updates->restart_ticks);
  EXPECT_EQ(updates->remove_ids[0], 3u);
  EXPECT_EQ(updates->remove_groups[0], 4u);
  ASSERT_EQ(updates->inserts.size(), 1u);
  const InsertColumns& inserted = updates->inserts[0];
  EXPECT_EQ(inserted.ids.data(), insert->ids().data());
  EXPECT_EQ(inserted.kind, ShapeKind::kCapsule);
  EXPECT_EQ(inserted.positions_f64.size(), 3u);
  EXPECT_TRUE(inserted.positions.empty());
  EXPECT_EQ(inserted.radii[0], 0.5f);
  EXPECT_EQ(inserted.extents[2], 2.f);
  EXPECT_EQ(inserted.layers[0], 6u);
  EXPECT_EQ(inserted.expire_ticks[0], 30u);
  EXPECT_EQ(inserted.groups[0], 7u);
  EXPECT_EQ(inserted.tags[0], 8u);
  ASSERT_EQ(updates->moves.size(), 1u);
  EXPECT_EQ(updates->moves[0].positions.size(), 3u);
  EXPECT_EQ(updates->moves[0].rotations.size(), 4u);
  EXPECT_TRUE(updates->moves[0].teleport);
  ASSERT_EQ(updates->relabels.size(), 1u);
  EXPECT_EQ(updates->relabels[0].ids[0], 10u);
  ASSERT_EQ(updates->instance_moves.size(), 1u);
  EXPECT_EQ(updates->instance_moves[0].ids[0], 20u);
  EXPECT_EQ(updates->instance_moves[0].positions_f64.size(), 3u);
  EXPECT_EQ(updates->instance_moves[0].rotations.size(), 4u);
  EXPECT_EQ(updates->instance_moves[0].scales[0], 2);
  EXPECT_TRUE(updates->instance_moves[0].teleport);
  ASSERT_EQ(updates->instance_relabels.size(), 1u);
  EXPECT_EQ(updates->instance_relabels[0].ids[0], 21u);
  EXPECT_EQ(updates->instance_relabels[0].layers.size(), 1u);
  EXPECT_EQ(updates->writer, 11u);
  EXPECT_EQ(updates->batch, 12u);
}

TEST(ConvertUpdatesTest, CompoundsAndNewPosesOfPartsArrive) {
  v1::UpdateBatch batch;
  v1::Insert* insert = batch.add_inserts();
  v1::Parts* balls = insert->mutable_compound()->add_parts();
  for (const float x : {1.f, 2.f, 3.f}) balls->add_positions(x);
  for (const float x : {0.f, 0.f, 0.f, 1.f}) balls->add_rotations(x);
  balls->mutable_ball()->add_radii(4);
  balls->add_layers(5);
  v1::Parts* boxes = insert->mutable_compound()->add_parts();
  boxes->mutable_box()->add_half_extents(6);
  v1::Parts* capsules = insert->mutable_compound()->add_parts();
  capsules->mutable_capsule()->add_radii(7);
  capsules->mutable_capsule()->add_half_axes(8);
  v1::Move* move = batch.add_moves();
  move->set_parts_each(2);
  move->add_part_positions(9);
  move->add_part_rotations(10);
  const absl::StatusOr<UpdateBatch> updates = to_updates(batch);
  ASSERT_TRUE(updates.ok()) << updates.status();
  const std::vector<PartColumns>& parts = updates->inserts[0].parts;
  ASSERT_EQ(parts.size(), 3u);
  EXPECT_EQ(updates->inserts[0].kind, ShapeKind::kCompound);
  EXPECT_EQ(parts[0].kind, ShapeKind::kBall);
  EXPECT_EQ(parts[0].positions.at(2), 3);
  EXPECT_EQ(parts[0].rotations.at(3), 1);
  EXPECT_EQ(parts[0].radii.at(0), 4);
  EXPECT_EQ(parts[0].layers.at(0), 5u);
  EXPECT_EQ(parts[1].kind, ShapeKind::kBox);
  EXPECT_EQ(parts[1].extents.at(0), 6);
  EXPECT_EQ(parts[2].kind, ShapeKind::kCapsule);
  EXPECT_EQ(parts[2].radii.at(0), 7);
  EXPECT_EQ(parts[2].extents.at(0), 8);
  EXPECT_EQ(updates->moves[0].parts_each, 2u);
  EXPECT_EQ(updates->moves[0].part_positions.at(0), 9);
  EXPECT_EQ(updates->moves[0].part_rotations.at(0), 10);
  move->set_parts_each(65);
  EXPECT_EQ(refusal_of(to_updates(batch).status())->field, "moves[0].parts_each");
  boxes->clear_shape();
  EXPECT_EQ(refusal_of(to_updates(batch).status())->field, "inserts[0].compound.parts[1].shape");
}

TEST(ConvertUpdatesTest, AMoveOfInstancesNeedsOneColumnOfPositions) {
  v1::UpdateBatch batch;
  v1::InstanceMove* move = batch.add_instance_moves();
  move->add_ids(20);
  EXPECT_EQ(refusal_of(to_updates(batch).status())->field, "instance_moves[0].positions");
  for (int i = 0; i < 3; ++i) move->add_positions(0);
  EXPECT_TRUE(to_updates(batch).ok());
  for (int i = 0; i < 3; ++i) move->add_positions_f64(0);
  EXPECT_EQ(refusal_of(to_updates(batch).status())->field, "instance_moves[0].positions_f64");
}

TEST(ConvertUpdatesTest, AnEmptyMessageConvertsToTheDefaults) {
  const absl::StatusOr<UpdateBatch> updates = to_updates({});
  ASSERT_TRUE(updates.ok());
  EXPECT_FALSE(updates->tick.has_value());
  EXPECT_FALSE(updates->clear);
  EXPECT_TRUE(updates->inserts.empty());
}

TEST(ConvertUpdatesTest, EveryFieldOfAnAckArrives) {
  UpdateAck ack;
  ack.epoch = 1;
  ack.revision = 2;
  ack.tick = 3;
  ack.applied = 4;
  ack.refused = 5;
  ack.duplicate = true;
  ack.errors = {{"moves[1].positions", 6, 7, Reason::kNotFinite}};
  const v1::UpdateAck out = to_proto(ack);
  EXPECT_EQ(out.epoch(), 1u);
  EXPECT_EQ(out.revision(), 2u);
  EXPECT_EQ(out.tick(), 3u);
  EXPECT_EQ(out.applied(), 4u);
  EXPECT_EQ(out.refused(), 5u);
  EXPECT_TRUE(out.duplicate());
  ASSERT_EQ(out.errors_size(), 1);
  EXPECT_EQ(out.errors(0).field(), "moves[1].positions");
  EXPECT_EQ(out.errors(0).index(), 6u);
  EXPECT_EQ(out.errors(0).id(), 7u);
  EXPECT_EQ(out.errors(0).reason(), v1::REASON_NOT_FINITE);
}

}  // namespace
}  // namespace locus::server
