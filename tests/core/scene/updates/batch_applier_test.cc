// Tests the application of the items of a batch through a scene: their order, refused items, values of columns that a
// batch omits, and rounding.
#include "core/scene/updates/batch_applier.h"

#include <limits>

#include "core/base/limits.h"
#include "core/scene/scene_writer.h"
#include "tests/support/random.h"
#include "tests/support/scene_fixture.h"
#include "tests/support/special_floats.h"

namespace locus::test {
namespace {

class BatchApplierTest : public SceneFixture {
 protected:
  // Applies a batch that has one refused item, and returns the error of that item.
  ItemError only_error(const UpdateBatch& batch) {
    const UpdateAck ack = apply(batch);
    EXPECT_EQ(ack.refused, 1u);
    if (ack.errors.size() != 1) ADD_FAILURE() << ack.errors.size() << " errors";
    return ack.errors.empty() ? ItemError{} : ack.errors[0];
  }

  void expect_error(const UpdateBatch& batch, const std::string& field, uint32_t index, Id id, Reason reason) {
    const ItemError error = only_error(batch);
    EXPECT_EQ(error.field, field);
    EXPECT_EQ(error.index, index);
    EXPECT_EQ(error.id, id);
    EXPECT_EQ(error.reason, reason);
  }

  InsertColumns boxes(std::vector<Id> ids, std::vector<float> half_extents) {
    InsertColumns insert = points(std::move(ids), {0, 0, 0});
    insert.kind = ShapeKind::kBox;
    insert.extents = columns_.floats(std::move(half_extents));
    return insert;
  }
};

TEST_F(BatchApplierTest, InsertsTakeOneEntryForAllOrOneEach) {
  InsertColumns insert = balls({1, 2}, {3, 4});
  insert.tags = columns_.ids({9});
  EXPECT_EQ(apply(with(insert)).applied, 2u);
  EXPECT_EQ(object(1)->shape.radius, 3);
  EXPECT_EQ(object(2)->shape.radius, 4);
  EXPECT_EQ(object(1)->tag, 9u);
  EXPECT_EQ(object(2)->tag, 9u);
}

TEST_F(BatchApplierTest, AllCompoundsOfAnInsertShareTheirParts) {
  EXPECT_EQ(apply(with(compounds({1, 2}, {0, 0, 1, 0, 0, 2}, {0.5f}))).applied, 2u);
  ASSERT_NE(object(1)->compound, nullptr);
  EXPECT_EQ(object(1)->compound, object(2)->compound);
  EXPECT_EQ(object(1)->compound->parts().size(), 2u);
  EXPECT_EQ(object(1)->compound->parts()[1].position, (Vec3f{0, 0, 2}));
  EXPECT_EQ(object(1)->shape.kind, ShapeKind::kCompound);
}

TEST_F(BatchApplierTest, CompoundsWithoutLayersHaveAllLayersOfTheirParts) {
  InsertColumns insert = compounds({1}, {0, 0, 1, 0, 0, 2}, {0.5f});
  apply(with(insert));
  EXPECT_EQ(object(1)->layers, kDefaultLayers);
  insert.ids = columns_.ids({2});
  insert.parts[0].layers = columns_.words({2, 8});
  apply(with(insert));
  EXPECT_EQ(object(2)->layers, 10u);
  insert.ids = columns_.ids({3});
  insert.layers = columns_.words({16});
  apply(with(insert));
  EXPECT_EQ(object(3)->layers, 16u);
}

TEST_F(BatchApplierTest, AWrongValueOfAPartRefusesEachCompoundOfTheInsert) {
  InsertColumns insert = compounds({1, 2}, {0, 0, 1}, {1});
  insert.parts.push_back({ShapeKind::kBall, columns_.floats({1, 1, 1, 2, 2, 2}), {}, columns_.floats({1, -1}), {}, {}});
  const UpdateAck ack = apply(with(insert));
  EXPECT_EQ(ack.refused, 2u);
  ASSERT_EQ(ack.errors.size(), 2u);
  EXPECT_EQ(ack.errors[1].field, "inserts[0].compound.parts[1].ball.radii");
  EXPECT_EQ(ack.errors[1].index, 1u);
  EXPECT_EQ(ack.errors[1].id, 2u);
  EXPECT_EQ(ack.errors[1].reason, Reason::kOutOfRange);
  insert = compounds({1}, {0, 2e9f, 1}, {1});
  expect_error(with(insert), "inserts[0].compound.parts[0].positions", 0, 1, Reason::kOutOfRange);
  insert = compounds({1}, {0, 0, 1}, {std::numeric_limits<float>::quiet_NaN()});
  expect_error(with(insert), "inserts[0].compound.parts[0].ball.radii", 0, 1, Reason::kNotFinite);
  insert = compounds({1}, {0, 0, 1}, {1});
  insert.parts[0].rotations = columns_.floats({0, 0, 0, 2});
  expect_error(with(insert), "inserts[0].compound.parts[0].rotations", 0, 1, Reason::kOutOfRange);
  EXPECT_FALSE(object(1));
}

TEST_F(BatchApplierTest, MovesGivePartsNewPoses) {
  apply(with(compounds({1, 2}, {0, 0, 1, 0, 0, 2}, {0.5f})));
  MoveColumns move = move_to({1}, {5, 5, 5});
  move.parts_each = 2;
  move.part_positions = columns_.floats({7, 0, 0, 8, 0, 0});
  EXPECT_EQ(apply(with(move)).applied, 1u);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{5, 5, 5}));
  EXPECT_EQ(object(1)->compound->parts()[1].position, (Vec3f{8, 0, 0}));
  EXPECT_EQ(object(1)->compound->parts()[1].radius, 0.5f);
  EXPECT_EQ(object(2)->compound->parts()[1].position, (Vec3f{0, 0, 2}));
  const uint64_t before = revision();
  apply(with(move));
  EXPECT_EQ(revision(), before);  // equal poses change nothing
}

TEST_F(BatchApplierTest, NewPosesOfPartsThatDoNotFitAreRefused) {
  apply(with(compounds({1}, {0, 0, 1, 0, 0, 2}, {0.5f})));
  apply(with(balls({2}, {1})));
  MoveColumns move = move_to({1}, {5, 5, 5});
  move.parts_each = 1;
  move.part_positions = columns_.floats({7, 0, 0});
  expect_error(with(move), "moves[0].parts_each", 0, 1, Reason::kOutOfRange);
  move.ids = columns_.ids({2});
  expect_error(with(move), "moves[0].parts_each", 0, 2, Reason::kOutOfRange);
  move.ids = columns_.ids({1});
  move.parts_each = 2;
  move.part_positions = columns_.floats({7, 0, 0, 8, 0, std::numeric_limits<float>::infinity()});
  expect_error(with(move), "moves[0].part_positions", 0, 1, Reason::kNotFinite);
  move.part_positions = {};
  move.part_rotations = columns_.floats({0, 0, 0, 1, 0, 0, 0, 1.1f});
  expect_error(with(move), "moves[0].part_rotations", 0, 1, Reason::kOutOfRange);
  EXPECT_EQ(object(1)->shape.position, Vec3d{});
}

TEST_F(BatchApplierTest, UpsertsReplaceCompoundsByOtherShapesAndBack) {
  apply(with(compounds({1}, {0, 0, 1}, {0.5f})));
  UpdateBatch ball = with(balls({1}, {3}));
  ball.upsert = true;
  apply(ball);
  EXPECT_EQ(object(1)->compound, nullptr);
  EXPECT_EQ(object(1)->shape.radius, 3);
  UpdateBatch compound = with(compounds({1}, {0, 0, 4}, {0.5f}));
  compound.upsert = true;
  apply(compound);
  ASSERT_NE(object(1)->compound, nullptr);
  EXPECT_EQ(object(1)->compound->parts()[0].position, (Vec3f{0, 0, 4}));
}

TEST_F(BatchApplierTest, AbsentColumnsOfInsertsAreTheDefaults) {
  apply(with(points({1}, {1, 2, 3})));
  EXPECT_EQ(object(1)->group, 0u);
  EXPECT_EQ(object(1)->tag, 0u);
  EXPECT_EQ(object(1)->layers, kDefaultLayers);
  EXPECT_EQ(object(1)->shape.rotation, Quaternion{});
}

TEST_F(BatchApplierTest, AppliesRemovesThenInsertsThenMovesThenRelabels) {
  apply(with(points({1}, {0, 0, 0})));
  UpdateBatch batch = with(points({1}, {5, 5, 5}));
  batch.remove_ids = columns_.ids({1});
  batch.moves.push_back(move_to({1}, {6, 6, 6}));
  RelabelColumns relabel;
  relabel.ids = columns_.ids({1});
  relabel.tags = columns_.ids({42});
  batch.relabels.push_back(relabel);
  const UpdateAck ack = apply(batch);
  EXPECT_EQ(ack.applied, 4u);
  EXPECT_EQ(ack.revision, 2u);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{6, 6, 6}));
  EXPECT_EQ(object(1)->tag, 42u);
}

TEST_F(BatchApplierTest, ClearIsAppliedBeforeRemoves) {
  apply(with(points({1, 2}, {0, 0, 0})));
  UpdateBatch batch = removing({1});
  batch.clear = true;
  expect_error(batch, "remove_ids", 0, 1, Reason::kUnknownId);
  EXPECT_TRUE(ids().empty());
}

TEST_F(BatchApplierTest, ClearAndInsertOfAKnownIdIsNoDuplicate) {
  apply(with(balls({1, 2}, {1})));
  UpdateBatch batch = with(points({2}, {3, 3, 3}));
  batch.clear = true;
  EXPECT_EQ(apply(batch).refused, 0u);
  EXPECT_EQ(ids(), (std::vector<Id>{2}));
  EXPECT_EQ(object(2)->shape.kind, ShapeKind::kPoint);
  EXPECT_EQ(scene_.latest()->objects.size(), 1u);
}

TEST_F(BatchApplierTest, ClearLeavesInstances) {
  ASSERT_TRUE(scene_.change_instances(placing(placement({8}, {0, 0, 0}))).ok());
  UpdateBatch batch;
  batch.clear = true;
  apply(batch);
  EXPECT_NE(scene_.latest()->statics->find(8), nullptr);
}

TEST_F(BatchApplierTest, TheLaterOfTwoMovesOfOneObjectWins) {
  apply(with(points({1}, {0, 0, 0})));
  EXPECT_EQ(apply(with(move_to({1, 1}, {1, 1, 1, 2, 2, 2}))).applied, 2u);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{2, 2, 2}));
}

TEST_F(BatchApplierTest, TheSecondInsertOfAnIdInOneBatchIsRefused) {
  expect_error(with(points({1, 1}, {1, 1, 1, 2, 2, 2})), "inserts[0].ids", 1, 1, Reason::kDuplicateId);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{1, 1, 1}));
}

TEST_F(BatchApplierTest, InsertOfAKnownIdIsRefused) {
  apply(with(points({1}, {1, 1, 1})));
  expect_error(with(points({2, 1}, {2, 2, 2})), "inserts[0].ids", 1, 1, Reason::kDuplicateId);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{1, 1, 1}));
  EXPECT_TRUE(object(2).has_value());
}

TEST_F(BatchApplierTest, UpsertReplacesShapeAndLabels) {
  InsertColumns first = balls({1}, {2});
  first.tags = columns_.ids({5});
  first.groups = columns_.ids({6});
  apply(with(first));
  UpdateBatch batch = with(points({1}, {3, 3, 3}));
  batch.upsert = true;
  EXPECT_EQ(apply(batch).applied, 1u);
  Object expected;
  expected.id = 1;
  expected.shape.position = {3, 3, 3};
  EXPECT_EQ(*object(1), expected);
}

TEST_F(BatchApplierTest, OfTwoUpsertsOfAnIdInOneBatchTheLaterStaysAndBothAreApplied) {
  UpdateBatch batch = with(points({1, 1}, {1, 1, 1, 2, 2, 2}));
  batch.inserts.push_back(balls({1}, {7}));
  batch.upsert = true;
  const UpdateAck ack = apply(batch);
  EXPECT_EQ(ack.applied, 3u);
  EXPECT_EQ(ack.refused, 0u);
  EXPECT_EQ(object(1)->shape.kind, ShapeKind::kBall);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{0, 0, 0}));
}

TEST_F(BatchApplierTest, ARefusedUpsertKeepsTheEffectOfTheEarlierOne) {
  UpdateBatch batch = with(points({1, 1}, {1, 1, 1, kNan, 2, 2}));
  batch.upsert = true;
  expect_error(batch, "inserts[0].positions", 1, 1, Reason::kNotFinite);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{1, 1, 1}));
}

TEST_F(BatchApplierTest, ARemovedIdIsInsertedAgainOnceUnlessUpsertIsSet) {
  for (const bool upsert : {false, true}) {
    apply(with(points({1}, {9, 9, 9})));
    UpdateBatch batch = with(points({1, 1}, {1, 1, 1, 2, 2, 2}));
    batch.remove_ids = columns_.ids({1});
    batch.upsert = upsert;
    const UpdateAck ack = apply(batch);
    EXPECT_EQ(ack.applied, upsert ? 3u : 2u);
    EXPECT_EQ(ack.refused, upsert ? 0u : 1u);
    const double x = upsert ? 2 : 1;
    EXPECT_EQ(object(1)->shape.position, (Vec3d{x, x, x}));
    apply(removing({1}));
  }
}

TEST_F(BatchApplierTest, ALaterMoveWithoutRotationKeepsThatOfTheEarlierOne) {
  apply(with(points({1}, {0, 0, 0})));
  MoveColumns first = move_to({1}, {1, 1, 1});
  first.rotations = columns_.floats({1, 0, 0, 0});
  UpdateBatch batch = with(first);
  batch.moves.push_back(move_to({1}, {2, 2, 2}));
  EXPECT_EQ(apply(batch).applied, 2u);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{2, 2, 2}));
  EXPECT_EQ(object(1)->shape.rotation, (Quaternion{1, 0, 0, 0}));
}

TEST_F(BatchApplierTest, AnEntryForAllThatIsWrongRefusesEachItemUnderItsOwnIndex) {
  const UpdateAck ack = apply(with(balls({4, 5}, {-1})));
  ASSERT_EQ(ack.errors.size(), 2u);
  for (uint32_t i = 0; i < 2; ++i) {
    EXPECT_EQ(ack.errors[i].field, "inserts[0].ball.radii");
    EXPECT_EQ(ack.errors[i].index, i);
    EXPECT_EQ(ack.errors[i].id, 4 + i);
  }
}

TEST_F(BatchApplierTest, TheIndexOfAWrongRotationIsThatOfItsItem) {
  InsertColumns insert = points({4, 5}, {0, 0, 0});
  insert.rotations = columns_.floats({0, 0, 0, 1, 0, 0, 0, 2});
  expect_error(with(insert), "inserts[0].rotations", 1, 5, Reason::kOutOfRange);
}

TEST_F(BatchApplierTest, OfAnItemWithSeveralFaultsTheFirstColumnIsNamed) {
  InsertColumns insert = balls({4}, {-1});
  insert.positions = columns_.floats({kNan, 0, 0});
  insert.rotations = columns_.floats({0, 0, 0, 2});
  expect_error(with(insert), "inserts[0].positions", 0, 4, Reason::kNotFinite);
  insert.positions = columns_.floats({0, 0, 0});
  expect_error(with(insert), "inserts[0].rotations", 0, 4, Reason::kOutOfRange);
}

TEST_F(BatchApplierTest, TheIdOfAnInstanceIsRefusedEvenByUpsert) {
  ASSERT_TRUE(scene_.change_instances(placing(placement({8}, {0, 0, 0}))).ok());
  UpdateBatch batch = with(points({8}, {0, 0, 0}));
  batch.upsert = true;
  expect_error(batch, "inserts[0].ids", 0, 8, Reason::kDuplicateId);
}

TEST_F(BatchApplierTest, IdZeroIsRefused) {
  expect_error(with(points({0}, {0, 0, 0})), "inserts[0].ids", 0, 0, Reason::kOutOfRange);
}

TEST_F(BatchApplierTest, MovesOfInstancesAndUnknownIdsAreRefused) {
  ASSERT_TRUE(scene_.change_instances(placing(placement({8}, {0, 0, 0}))).ok());
  expect_error(with(move_to({8}, {0, 0, 0})), "moves[0].ids", 0, 8, Reason::kUnknownId);
  expect_error(with(move_to({3}, {0, 0, 0})), "moves[0].ids", 0, 3, Reason::kUnknownId);
}

TEST_F(BatchApplierTest, RemovesOfUnknownIdsAndSecondRemovesAreRefused) {
  apply(with(points({1}, {0, 0, 0})));
  expect_error(removing({1, 1}), "remove_ids", 1, 1, Reason::kUnknownId);
  EXPECT_TRUE(ids().empty());
}

TEST_F(BatchApplierTest, AMoveAfterARemoveInOneBatchIsRefused) {
  apply(with(points({1}, {0, 0, 0})));
  UpdateBatch batch = removing({1});
  batch.moves.push_back(move_to({1}, {1, 1, 1}));
  expect_error(batch, "moves[0].ids", 0, 1, Reason::kUnknownId);
}

TEST_F(BatchApplierTest, RelabelOfAnUnknownIdIsRefused) {
  RelabelColumns relabel;
  relabel.ids = columns_.ids({4});
  expect_error(with(relabel), "relabels[0].ids", 0, 4, Reason::kUnknownId);
}

TEST_F(BatchApplierTest, PositionsMustBeFinite) {
  expect_error(with(points({1, 2}, {0, 0, 0, 0, kNan, 0})), "inserts[0].positions", 1, 2, Reason::kNotFinite);
  expect_error(with(points({3}, {0, 0, kInfinity})), "inserts[0].positions", 0, 3, Reason::kNotFinite);
  expect_error(with(move_to({1}, {kNan, 0, 0})), "moves[0].positions", 0, 1, Reason::kNotFinite);
  EXPECT_EQ(object(1)->shape.position, Vec3d{});
}

TEST_F(BatchApplierTest, TheSumOfFrameAndOffsetMustLieWithinTheWorld) {
  UpdateBatch batch = with(points({1, 2}, {0, 0, 0, 1, 0, 0}));
  batch.frame = {1e9, 0, 0};
  expect_error(batch, "inserts[0].positions", 1, 2, Reason::kOutOfRange);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{1e9, 0, 0}));
}

TEST_F(BatchApplierTest, AbsolutePositionsAreNamedAndIgnoreTheFrame) {
  InsertColumns insert;
  insert.ids = columns_.ids({1, 2});
  insert.positions_f64 = columns_.doubles({0.1, 0.2, 0.3, 2e9, 0, 0});
  UpdateBatch batch = with(insert);
  batch.frame = {1000, 0, 0};
  expect_error(batch, "inserts[0].positions_f64", 1, 2, Reason::kOutOfRange);
  EXPECT_EQ(object(1)->shape.position, (Vec3d{0.1, 0.2, 0.3}));
}

TEST_F(BatchApplierTest, PositionsAreFramePlusOffsetRoundedOnceToDouble) {
  UpdateBatch batch = with(points({1}, {0.1f, -0.1f, 0}));
  batch.frame = {0.7, 123456789.125, 0.3};
  apply(batch);
  // The literals are the exact values of 0.1f and -0.1f; each sum is rounded once.
  EXPECT_EQ(object(1)->shape.position.x, 0.7 + 0.100000001490116119384765625);
  EXPECT_EQ(object(1)->shape.position.y, 123456789.125 - 0.100000001490116119384765625);
  EXPECT_EQ(object(1)->shape.position.z, 0.3);
}

TEST_F(BatchApplierTest, RadiiMustBeFiniteAndNotNegative) {
  expect_error(with(balls({1, 2}, {0, -1})), "inserts[0].ball.radii", 1, 2, Reason::kOutOfRange);
  expect_error(with(balls({3}, {kNan})), "inserts[0].ball.radii", 0, 3, Reason::kNotFinite);
  expect_error(with(balls({3}, {2e9f})), "inserts[0].ball.radii", 0, 3, Reason::kOutOfRange);
  EXPECT_EQ(ids(), (std::vector<Id>{1}));
}

TEST_F(BatchApplierTest, HalfExtentsMustBeFiniteAndNotNegative) {
  expect_error(with(boxes({1, 2}, {0, 0, 0, 1, -1, 1})), "inserts[0].box.half_extents", 1, 2, Reason::kOutOfRange);
  expect_error(with(boxes({3}, {1, 1, kInfinity})), "inserts[0].box.half_extents", 0, 3, Reason::kNotFinite);
}

TEST_F(BatchApplierTest, HalfAxesMayBeNegative) {
  InsertColumns capsules = balls({1, 2}, {1});
  capsules.kind = ShapeKind::kCapsule;
  capsules.extents = columns_.floats({-1, -2, -3, 0, kNan, 0});
  expect_error(with(capsules), "inserts[0].capsule.half_axes", 1, 2, Reason::kNotFinite);
  EXPECT_EQ(object(1)->shape.size, (Vec3f{-1, -2, -3}));
}

TEST_F(BatchApplierTest, CapsuleRadiiAreNamedAsSuch) {
  InsertColumns capsules = balls({1}, {-1});
  capsules.kind = ShapeKind::kCapsule;
  capsules.extents = columns_.floats({0, 0, 1});
  expect_error(with(capsules), "inserts[0].capsule.radii", 0, 1, Reason::kOutOfRange);
}

TEST_F(BatchApplierTest, RotationsOffUnitLengthAreRefused) {
  InsertColumns insert = points({1, 2}, {0, 0, 0});
  insert.rotations = columns_.floats({0, 0, 0, 1.0009f, 0, 0, 0, 1.0011f});
  expect_error(with(insert), "inserts[0].rotations", 1, 2, Reason::kOutOfRange);
  EXPECT_EQ(object(1)->shape.rotation, Quaternion{});
}

TEST_F(BatchApplierTest, RotationsMustBeFinite) {
  apply(with(points({1}, {0, 0, 0})));
  MoveColumns move = move_to({1}, {5, 0, 0});
  move.rotations = columns_.floats({0, kNan, 0, 1});
  expect_error(with(move), "moves[0].rotations", 0, 1, Reason::kNotFinite);
  EXPECT_EQ(object(1)->shape.position, Vec3d{});
}

TEST_F(BatchApplierTest, RotationsAreStoredNormalised) {
  InsertColumns insert = points({1}, {0, 0, 0});
  insert.rotations = columns_.floats({0.6f, 0, 0, 0.8005f});
  apply(with(insert));
  EXPECT_LT(unit_deviation(object(1)->shape.rotation), 1e-7);
}

TEST_F(BatchApplierTest, AStoredRotationThatIsSentAgainKeepsItsBits) {
  Random random(17);
  for (int i = 0; i < 2000; ++i) {
    InsertColumns insert = points({1}, {0, 0, 0});
    const Vec3d v = random.unit_vector();
    insert.rotations = columns_.floats({float(v.x * 0.8), float(v.y * 0.8), float(v.z * 0.8), 0.6f});
    UpdateBatch batch = with(insert);
    batch.upsert = true;
    apply(batch);
    const Quaternion stored = object(1)->shape.rotation;
    MoveColumns move = move_to({1}, {0, 0, 0});
    move.rotations = columns_.floats({stored.x, stored.y, stored.z, stored.w});
    apply(with(move));
    ASSERT_EQ(object(1)->shape.rotation, stored) << "seed 17, case " << i;
  }
}

TEST_F(BatchApplierTest, AMoveWithoutRotationKeepsIt) {
  InsertColumns insert = points({1}, {0, 0, 0});
  insert.rotations = columns_.floats({0, 0, 1, 0});
  apply(with(insert));
  apply(with(move_to({1}, {1, 0, 0})));
  EXPECT_EQ(object(1)->shape.rotation, (Quaternion{0, 0, 1, 0}));
}

TEST_F(BatchApplierTest, AMoveKeepsShapeAndLabels) {
  InsertColumns insert = balls({1}, {2});
  insert.tags = columns_.ids({5});
  apply(with(insert));
  apply(with(move_to({1}, {1, 0, 0})));
  EXPECT_EQ(object(1)->shape.kind, ShapeKind::kBall);
  EXPECT_EQ(object(1)->shape.radius, 2);
  EXPECT_EQ(object(1)->tag, 5u);
}

TEST_F(BatchApplierTest, RelabelKeepsLabelsWithoutAColumn) {
  InsertColumns insert = balls({1}, {2});
  insert.layers = columns_.words({4});
  insert.groups = columns_.ids({5});
  insert.tags = columns_.ids({6});
  apply(with(insert));
  RelabelColumns relabel;
  relabel.ids = columns_.ids({1});
  relabel.layers = columns_.words({0});
  apply(with(relabel));
  EXPECT_EQ(object(1)->layers, 0u);
  EXPECT_EQ(object(1)->group, 5u);
  EXPECT_EQ(object(1)->tag, 6u);
  EXPECT_EQ(object(1)->shape.radius, 2);
}

TEST_F(BatchApplierTest, RemoveGroupsRemovesEveryObjectOfThem) {
  InsertColumns insert = points({1, 2, 3, 4}, {0, 0, 0});
  insert.groups = columns_.ids({7, 8, 7, 0});
  apply(with(insert));
  UpdateBatch batch;
  batch.remove_groups = columns_.ids({7, 99});
  EXPECT_EQ(apply(batch).applied, 2u);
  EXPECT_EQ(ids(), (std::vector<Id>{2, 4}));
}

TEST_F(BatchApplierTest, GroupZeroIsNoGroupToRemove) {
  apply(with(points({1}, {0, 0, 0})));
  UpdateBatch batch;
  batch.remove_groups = columns_.ids({3, 0});
  expect_error(batch, "remove_groups", 1, 0, Reason::kOutOfRange);
  EXPECT_EQ(ids(), (std::vector<Id>{1}));
}

TEST_F(BatchApplierTest, OneThousandErrorsAreListedAndAllAreCounted) {
  std::vector<Id> unknown(2500);
  for (size_t i = 0; i < unknown.size(); ++i) unknown[i] = 10 + i;
  const UpdateAck ack = apply(removing(unknown));
  EXPECT_EQ(ack.refused, 2500u);
  ASSERT_EQ(ack.errors.size(), 1000u);
  EXPECT_EQ(ack.errors.back().index, 999u);
  EXPECT_EQ(ack.errors.back().id, 1009u);
}

TEST_F(BatchApplierTest, ErrorsAreListedInOrderOfApplication) {
  UpdateBatch batch = with(points({0}, {0, 0, 0}));
  batch.inserts.push_back(points({5, 0}, {0, 0, 0}));
  batch.moves.push_back(move_to({6}, {0, 0, 0}));
  batch.remove_ids = columns_.ids({7});
  const UpdateAck ack = apply(batch);
  ASSERT_EQ(ack.errors.size(), 4u);
  EXPECT_EQ(ack.errors[0].field, "remove_ids");
  EXPECT_EQ(ack.errors[1].field, "inserts[0].ids");
  EXPECT_EQ(ack.errors[2].field, "inserts[1].ids");
  EXPECT_EQ(ack.errors[2].index, 1u);
  EXPECT_EQ(ack.errors[3].field, "moves[0].ids");
}

TEST_F(BatchApplierTest, AllOrNothingRefusesTheBatchByItsFirstError) {
  apply(with(points({1}, {0, 0, 0})));
  UpdateBatch batch = with(points({2, 3, 1}, {1, 1, 1, kNan, 1, 1, 2, 2, 2}));
  batch.all_or_nothing = true;
  batch.tick = 9;
  const SnapshotPtr before = scene_.latest();
  expect_refusal(scene_.apply(batch).status(), absl::StatusCode::kInvalidArgument, Reason::kNotFinite,
                 "inserts[0].positions", 1);
  EXPECT_EQ(scene_.latest(), before);
}

TEST_F(BatchApplierTest, AllOrNothingWithoutErrorsIsApplied) {
  UpdateBatch batch = with(points({2, 3}, {1, 1, 1}));
  batch.all_or_nothing = true;
  EXPECT_EQ(apply(batch).applied, 2u);
}

TEST_F(BatchApplierTest, TooManyObjectsRefuseTheBatchAndNameTheLimit) {
  SceneWriter writer(kEpoch, Winding::kCounterClockwise, StaticSet::empty(), 3);
  ASSERT_TRUE(writer.apply(with(points({1, 2}, {0, 0, 0}))).ok());
  const absl::Status status = writer.apply(with(points({3, 4}, {0, 0, 0}))).status();
  expect_refusal(status, absl::StatusCode::kResourceExhausted, Reason::kLimit, "inserts");
  EXPECT_EQ(refusal_of(status)->limit, "objects");
  EXPECT_EQ(refusal_of(status)->limit_value, 3);
  EXPECT_EQ(refusal_of(status)->asked, 4);
  EXPECT_EQ(writer.published()->objects.size(), 2u);
}

TEST_F(BatchApplierTest, RemovedAndReplacedObjectsMakeRoomWithinTheBatch) {
  SceneWriter writer(kEpoch, Winding::kCounterClockwise, StaticSet::empty(), 2);
  ASSERT_TRUE(writer.apply(with(points({1, 2}, {0, 0, 0}))).ok());
  UpdateBatch replace = with(points({3, 2}, {1, 1, 1}));
  replace.remove_ids = columns_.ids({1});
  replace.upsert = true;
  EXPECT_TRUE(writer.apply(replace).ok());
  UpdateBatch anew = with(points({7, 8}, {1, 1, 1}));
  anew.clear = true;
  EXPECT_TRUE(writer.apply(anew).ok());
}

}  // namespace
}  // namespace locus::test
