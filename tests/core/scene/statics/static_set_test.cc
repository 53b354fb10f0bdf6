// Tests static changes: the removals and placements of a change become one revision or are refused together.
#include "core/scene/statics/static_set.h"

#include <gmock/gmock.h>

#include <thread>

#include "core/base/limits.h"
#include "tests/support/scene_fixture.h"
#include "tests/support/special_floats.h"

namespace locus::test {
namespace {

class StaticSetTest : public SceneFixture {
 protected:
  InstanceChange change(const StaticChange& what) {
    const absl::StatusOr<InstanceChange> changed = scene_.change_instances(what);
    EXPECT_TRUE(changed.ok()) << changed.status();
    return changed.ok() ? *changed : InstanceChange{};
  }

  // Expects that the change `what` is refused with the given error, and that the scene still has the same snapshot.
  void expect_refused(const StaticChange& what, Reason reason, const std::string& field, std::optional<uint32_t> index,
                      absl::StatusCode code = absl::StatusCode::kInvalidArgument) {
    const SnapshotPtr before = scene_.latest();
    expect_refusal(scene_.change_instances(what).status(), code, reason, field, index);
    EXPECT_EQ(scene_.latest(), before);
  }

  StaticChange removing_instances(std::vector<Id> ids) {
    StaticChange what;
    what.remove_ids = columns_.ids(std::move(ids));
    return what;
  }

  const Instance* instance(Id id) const { return scene_.latest()->statics->find(id); }
};

TEST_F(StaticSetTest, PlacesWithDefaults) {
  const InstanceChange changed = change(placing(placement({5, 6}, {1, 2, 3, 4, 5, 6})));
  EXPECT_EQ(changed.placed, (std::vector<Id>{5, 6}));
  EXPECT_EQ(changed.revision, 1u);
  EXPECT_EQ(changed.epoch, kEpoch);
  ASSERT_NE(instance(6), nullptr);
  EXPECT_EQ(instance(6)->transform.translation, (Vec3d{4, 5, 6}));
  EXPECT_EQ(instance(6)->transform.quaternion, Quaternion{});
  EXPECT_EQ(instance(6)->transform.scale, 1);
  EXPECT_EQ(instance(6)->layers, kDefaultLayers);
  EXPECT_EQ(instance(6)->group, 0u);
  EXPECT_EQ(instance(6)->tag, 0u);
  EXPECT_EQ(instance(6)->mesh, mesh_);
}

TEST_F(StaticSetTest, ASingleEntryOfAColumnAppliesToAllPlacements) {
  PlacementColumns place = placement({5, 6}, {1, 2, 3});
  place.scales = columns_.floats({2});
  place.rotations = columns_.floats({0, 0, 1, 0});
  place.layers = columns_.words({4});
  place.groups = columns_.ids({7});
  place.tags = columns_.ids({8});
  change(placing(place));
  for (const Id id : {5, 6}) {
    EXPECT_EQ(instance(id)->transform.translation, (Vec3d{1, 2, 3}));
    EXPECT_EQ(instance(id)->transform.scale, 2);
    EXPECT_EQ(instance(id)->transform.quaternion, (Quaternion{0, 0, 1, 0}));
    EXPECT_EQ(instance(id)->layers, 4u);
    EXPECT_EQ(instance(id)->group, 7u);
    EXPECT_EQ(instance(id)->tag, 8u);
  }
}

TEST_F(StaticSetTest, ColumnsOfOtherLengthsAreRefused) {
  expect_refused(placing(placement({1, 2}, {1, 2, 3, 4})), Reason::kColumnLength, "place[0].translations", {});
  expect_refused(placing(placement({1, 2}, {})), Reason::kColumnLength, "place[0].translations", {});
  PlacementColumns place = placement({1, 2}, {1, 2, 3, 4, 5, 6});
  place.rotations = columns_.floats({0, 0, 0});
  expect_refused(placing(place), Reason::kColumnLength, "place[0].rotations", {});
  place.rotations = {};
  place.scales = columns_.floats({1, 1, 1});
  expect_refused(placing(place), Reason::kColumnLength, "place[0].scales", {});
}

TEST_F(StaticSetTest, ChosenIdsCountUpFromTheirFirstAndAreReturnedInOrder) {
  const std::vector<Id> placed = change(placing(placement({}, {1, 0, 0, 2, 0, 0}))).placed;
  ASSERT_EQ(placed.size(), 2u);
  EXPECT_THAT(placed, testing::ElementsAre(kFirstChosenId, kFirstChosenId + 1));
  EXPECT_EQ(instance(placed[1])->transform.translation.x, 2);
}

TEST_F(StaticSetTest, ChosenIdsAreNotUsedAgainAfterARemove) {
  const Id first = change(placing(placement({}, {0, 0, 0}))).placed[0];
  change(removing_instances({first}));
  EXPECT_NE(change(placing(placement({}, {0, 0, 0}))).placed[0], first);
}

TEST_F(StaticSetTest, ChosenIdsAvoidThoseOfObjects) {
  apply(with(points({kFirstChosenId}, {0, 0, 0})));
  const Id placed = change(placing(placement({}, {0, 0, 0}))).placed[0];
  EXPECT_FALSE(object(placed).has_value());
}

TEST_F(StaticSetTest, IdsChosenInAdvanceAreFreeAndNotChosenAgain) {
  apply(with(points({kFirstChosenId + 1}, {0, 0, 0})));
  change(placing(placement({kFirstChosenId + 3}, {0, 0, 0})));
  const std::vector<Id> chosen = scene_.choose_ids(3);
  EXPECT_THAT(chosen, testing::ElementsAre(kFirstChosenId, kFirstChosenId + 2, kFirstChosenId + 4));
  EXPECT_EQ(change(placing(placement({}, {0, 0, 0}))).placed[0], kFirstChosenId + 5);
  EXPECT_EQ(change(placing(placement({chosen[1]}, {0, 0, 0}))).placed[0], chosen[1]);
}

TEST_F(StaticSetTest, ASceneThatBeginsWithInstancesChoosesIdsAboveTheirs) {
  change(placing(placement({kFirstChosenId + 10}, {0, 0, 0})));
  Scene copy("copy", {}, kEpoch + 1, scene_.latest()->statics);
  EXPECT_EQ(copy.choose_ids(1).front(), kFirstChosenId + 11);
}

TEST_F(StaticSetTest, TheFirstIdAboveIgnoresLargeIdsOfCallers) {
  EXPECT_EQ(StaticSet::empty()->first_id_above(), kFirstChosenId);
  change(placing(placement({5, kFirstChosenId + 10, kEndOfChosenIds, ~Id{0}}, {0, 0, 0})));
  EXPECT_EQ(scene_.latest()->statics->first_id_above(), kFirstChosenId + 11);
}

TEST_F(StaticSetTest, RemovesAndPlacesAreOneRevision) {
  change(placing(placement({5, 6}, {0, 0, 0})));
  StaticChange what = placing(placement({6, 7}, {9, 9, 9}));
  what.remove_ids = columns_.ids({5, 6});
  EXPECT_EQ(change(what).revision, 2u);
  EXPECT_EQ(instance(5), nullptr);
  EXPECT_EQ(instance(6)->transform.translation, (Vec3d{9, 9, 9}));
  EXPECT_EQ(scene_.latest()->statics->size(), 2u);
}

TEST_F(StaticSetTest, RemovesWholeGroupsOfInstancesAndNoObjects) {
  PlacementColumns place = placement({1, 2, 3}, {0, 0, 0});
  place.groups = columns_.ids({7, 8, 7});
  change(placing(place));
  InsertColumns insert = points({10}, {0, 0, 0});
  insert.groups = columns_.ids({7});
  apply(with(insert));
  StaticChange what;
  what.remove_groups = columns_.ids({7, 99});
  change(what);
  EXPECT_EQ(scene_.latest()->statics->size(), 1u);
  EXPECT_NE(instance(2), nullptr);
  EXPECT_TRUE(object(10).has_value());
}

TEST_F(StaticSetTest, GroupZeroIsRefused) {
  change(placing(placement({1}, {0, 0, 0})));
  StaticChange what;
  what.remove_groups = columns_.ids({7, 0});
  expect_refused(what, Reason::kOutOfRange, "remove_groups", 1);
}

TEST_F(StaticSetTest, AnUnknownIdRefusesAllRemovesAndPlaces) {
  change(placing(placement({1}, {0, 0, 0})));
  StaticChange what = placing(placement({2}, {0, 0, 0}));
  what.remove_ids = columns_.ids({1, 3});
  expect_refused(what, Reason::kUnknownId, "remove_ids", 1);
}

TEST_F(StaticSetTest, TheIdOfAnObjectIsRefusedAsAnInstanceToRemove) {
  apply(with(points({4}, {0, 0, 0})));
  expect_refused(removing_instances({4}), Reason::kUnknownId, "remove_ids", 0);
}

TEST_F(StaticSetTest, TakenIdsAreRefused) {
  change(placing(placement({1}, {0, 0, 0})));
  apply(with(points({4}, {0, 0, 0})));
  expect_refused(placing(placement({2, 1}, {0, 0, 0})), Reason::kDuplicateId, "place[0].ids", 1);
  expect_refused(placing(placement({4}, {0, 0, 0})), Reason::kDuplicateId, "place[0].ids", 0);
}

TEST_F(StaticSetTest, AnIdPlacedTwiceIsRefused) {
  StaticChange what = placing(placement({2}, {0, 0, 0}));
  what.place.push_back(placement({3, 2}, {0, 0, 0}));
  expect_refused(what, Reason::kDuplicateId, "place[1].ids", 1);
}

TEST_F(StaticSetTest, IdZeroIsRefused) {
  expect_refused(placing(placement({1, 0}, {0, 0, 0})), Reason::kOutOfRange, "place[0].ids", 1);
}

TEST_F(StaticSetTest, TranslationsMustBeFiniteAndWithinTheWorld) {
  expect_refused(placing(placement({1, 2}, {0, 0, 0, kNan, 0, 0})), Reason::kNotFinite, "place[0].translations", 1);
  expect_refused(placing(placement({1}, {0, -2e9, 0})), Reason::kOutOfRange, "place[0].translations", 0);
}

TEST_F(StaticSetTest, ScalesMustBeFiniteAndPositive) {
  PlacementColumns place = placement({1, 2}, {0, 0, 0});
  place.scales = columns_.floats({1, 0});
  expect_refused(placing(place), Reason::kOutOfRange, "place[0].scales", 1);
  place.scales = columns_.floats({-1, 1});
  expect_refused(placing(place), Reason::kOutOfRange, "place[0].scales", 0);
  place.scales = columns_.floats({1, kInfinity});
  expect_refused(placing(place), Reason::kNotFinite, "place[0].scales", 1);
}

TEST_F(StaticSetTest, APlacedMeshMustNotExtendFarBeyondTheWorld) {
  PlacementColumns place = placement({1, 2}, {0, 0, 0});
  place.scales = columns_.floats({1, 3e9f});
  expect_refused(placing(place), Reason::kOutOfRange, "place[0].scales", 1);
}

TEST_F(StaticSetTest, RotationsMustBeFiniteAndOfUnitLength) {
  PlacementColumns place = placement({1, 2}, {0, 0, 0});
  place.rotations = columns_.floats({0, 0, 0, 1, 0, 0, 0, 0.99f});
  expect_refused(placing(place), Reason::kOutOfRange, "place[0].rotations", 1);
  place.rotations = columns_.floats({0, 0, kInfinity, 1, 0, 0, 0, 1});
  expect_refused(placing(place), Reason::kNotFinite, "place[0].rotations", 0);
}

TEST_F(StaticSetTest, LimitsOfAPlacementIncludeTheirEnds) {
  PlacementColumns place = placement({1, 2, 3, 4}, {1e9, -1e9, 1e9, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  place.scales = columns_.floats({1e-12f, 1e-12f, 1e9f, 1});
  place.rotations = columns_.floats({0, 0, 0, 1, 0, 0, 0, 0.9991f, 0, 0, 0, 1.0009f, 0, 0.6f, 0, 0.8f});
  change(placing(place));
  EXPECT_EQ(instance(2)->transform.quaternion, (Quaternion{0, 0, 0, 1})) << "normalised";
  const auto refused = [this](double x, float scale, float w, const std::string& column) {
    PlacementColumns one = placement({9}, {x, 0, 0});
    one.scales = columns_.floats({scale});
    one.rotations = columns_.floats({0, 0, 0, w});
    expect_refused(placing(one), Reason::kOutOfRange, "place[0]." + column, 0);
  };
  refused(std::nextafter(1e9, 2e9), 1, 1, "translations");
  refused(0, std::nextafter(1e-12f, 0.f), 1, "scales");
  refused(0, std::nextafter(1e12f, kInfinity), 1, "scales");
  refused(0, 1, 0.9989f, "rotations");
  refused(0, 1, 1.0011f, "rotations");
}

TEST_F(StaticSetTest, AMeshThatReachesBeyondTheWorldIsNamedByItsScaleEvenWithoutThatColumn) {
  mesh_ = make_mesh("wide", 2, {0, 0, 0, 1e9f, 0, 0, 0, 1e9f, 0});
  change(placing(placement({1}, {9.9e8, 0, 0})));
  PlacementColumns turned = placement({3, 2}, {0, 0, 0, 9.9e8, 0, 0});
  turned.scales = columns_.floats({1, 1.1f});
  expect_refused(placing(turned), Reason::kOutOfRange, "place[0].scales", 1);
  turned.scales = {};
  turned.rotations = columns_.floats({0, 0, -0.38268343f, 0.92387953f});
  expect_refused(placing(turned), Reason::kOutOfRange, "place[0].scales", 1);
}

TEST_F(StaticSetTest, ATranslationForAllThatIsWrongIsNamedWithTheFirstItem) {
  expect_refused(placing(placement({1, 2}, {0, kNan, 0})), Reason::kNotFinite, "place[0].translations", 0);
}

TEST_F(StaticSetTest, TooManyInstancesNameTheLimit) {
  const StaticChange what = placing(placement({}, std::vector<double>(3 * (size_t{limits::kMaxInstances} + 1))));
  expect_refused(what, Reason::kLimit, "place[0]", {}, absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refusal_of(scene_.change_instances(what).status())->limit, "instances");
}

TEST_F(StaticSetTest, AnObjectInsertedDuringTheBuildKeepsItsId) {
  // A thread places an instance while this thread inserts an object with the same id: exactly one of the two must be
  // refused.
  for (Id id = 1; id <= 50; ++id) {
    const StaticChange what = placing(placement({100 + id, id}, {0, 0, 0}));
    const UpdateBatch batch = with(points({id}, {0, 0, 0}));
    absl::Status placed;
    std::thread builder([&] { placed = scene_.change_instances(what).status(); });
    const UpdateAck ack = apply(batch);
    builder.join();
    EXPECT_NE(placed.ok(), ack.applied == 1) << id;
    EXPECT_NE(instance(id) != nullptr, object(id).has_value()) << id;
    if (!placed.ok())
      expect_refusal(placed, absl::StatusCode::kInvalidArgument, Reason::kDuplicateId, "place[0].ids", 1);
  }
}

TEST_F(StaticSetTest, ConcurrentChangesAreAllApplied) {
  std::vector<StaticChange> changes;
  for (Id id = 1; id <= 16; ++id) changes.push_back(placing(placement({id}, {double(id), 0, 0})));
  std::vector<std::thread> threads;
  for (const StaticChange& what : changes)
    threads.emplace_back([&] { EXPECT_TRUE(scene_.change_instances(what).ok()); });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(revision(), 16u);
  EXPECT_EQ(scene_.latest()->statics->size(), 16u);
  EXPECT_EQ(scene_.status().pending_changes, 0u);
}

TEST_F(StaticSetTest, PlacementsAreCheckedWithTheErrorsOfTheirChange) {
  EXPECT_TRUE(StaticSet::check_placements({placement({}, {1, 2, 3}), placement({5, 6}, {1, 2, 3})}).ok());
  const std::vector<std::vector<PlacementColumns>> bad = {
      {placement({5}, {1, 2, 3}), placement({6, 5}, {1, 2, 3})},
      {placement({5}, {1, 2, 3}), placement({0}, {1, 2, 3})},
      {placement({5}, {1, kNan, 3})},
      {placement({5}, {1, 2})},
  };
  for (const std::vector<PlacementColumns>& place : bad) {
    StaticChange change;
    change.place = place;
    const absl::Status status = StaticSet::check_placements(place);
    EXPECT_FALSE(status.ok());
    EXPECT_EQ(status, scene_.change_instances(change).status());
  }
}

TEST_F(StaticSetTest, UsesCountInstancesOfAMesh) {
  const auto other = make_mesh("other", 2);
  StaticChange what = placing(placement({1, 2}, {0, 0, 0}));
  what.place.push_back(placement({3}, {0, 0, 0}));
  what.place[1].mesh = other;
  change(what);
  EXPECT_EQ(scene_.latest()->statics->uses(mesh_.get()), 2u);
  EXPECT_EQ(scene_.latest()->statics->uses(other.get()), 1u);
  EXPECT_EQ(scene_.latest()->statics->triangle_count(), 3u);
  change(removing_instances({3}));
  EXPECT_EQ(scene_.latest()->statics->uses(other.get()), 0u);
}

// Returns the number of instances of `set` that it does not share with `other`.
size_t instances_apart(const StaticSet& set, const StaticSet& other) {
  size_t count = 0;
  set.tree().for_each_apart_from(other.tree(), [&count](const Instance&) { ++count; });
  return count;
}

TEST_F(StaticSetTest, AChangeOfOneOfManyInstancesSharesTheOthers) {
  std::vector<Id> ids;
  std::vector<double> translations;
  for (Id id = 1; id <= 5'000; ++id) {
    ids.push_back(id);
    for (const Id digit : {id % 10, id / 10 % 10, id / 100}) translations.push_back(10.0 * static_cast<double>(digit));
  }
  change(placing(placement(ids, translations)));
  const std::shared_ptr<const StaticSet> before = scene_.latest()->statics;
  change(removing_instances({77}));
  const std::shared_ptr<const StaticSet> removed = scene_.latest()->statics;
  change(placing(placement({77}, {3, 4, 5})));
  EXPECT_LE(instances_apart(*removed, *before), kBvhBlockValues);
  EXPECT_LE(instances_apart(*scene_.latest()->statics, *removed), 2 * kBvhBlockValues);
  EXPECT_LT(removed->unshared_bytes(*before), before->bytes() / 4);
  EXPECT_EQ(removed->unshared_bytes(*removed), 0u);
  EXPECT_NE(before->find(77), nullptr);
  EXPECT_EQ(removed->find(77), nullptr);
  EXPECT_EQ(instance(77)->transform.translation, (Vec3d{3, 4, 5}));
}

TEST_F(StaticSetTest, ReplacedInstancesAreFoundAtTheirNewPlaces) {
  change(placing(placement({1, 2, 3}, {0, 0, 0, 10, 0, 0, 20, 0, 0})));
  const std::shared_ptr<const StaticSet> before = scene_.latest()->statics;
  Instance moved = *before->find(2);
  moved.transform.translation = {50, 60, 70};
  moved.bounds = bounds_to_world(moved.transform, moved.mesh->bounds());
  const std::shared_ptr<const StaticSet> after = before->replace({moved});
  EXPECT_EQ(after->find(2)->transform.translation, (Vec3d{50, 60, 70}));
  EXPECT_TRUE(contains(after->tree().bounds(), moved.bounds));
  EXPECT_EQ(before->find(2)->transform.translation, (Vec3d{10, 0, 0}));
  EXPECT_EQ(after->size(), 3u);
  EXPECT_EQ(after->uses(mesh_.get()), 3u);
  EXPECT_EQ(after->find(1)->life, before->find(1)->life);
}

TEST_F(StaticSetTest, BoundsContainTheScaledRotatedAndTranslatedMesh) {
  PlacementColumns place = placement({1}, {100, 0, 0});
  place.scales = columns_.floats({10});
  place.rotations = columns_.floats({0, 0, 1, 0});  // half a turn about z, which negates x and y
  change(placing(place));
  const Aabbd bounds = instance(1)->bounds;
  EXPECT_NEAR(bounds.min.x, 90, 1e-6);
  EXPECT_NEAR(bounds.max.x, 100, 1e-6);
  EXPECT_NEAR(bounds.min.y, -10, 1e-6);
  EXPECT_LE(bounds.min.x, 90);
  EXPECT_GE(bounds.max.x, 100);
}

}  // namespace
}  // namespace locus::test
