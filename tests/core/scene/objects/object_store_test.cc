#include "core/scene/objects/object_store.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tests/support/random.h"

namespace locus::test {
namespace {

Object random_object(Id id, Random& random) {
  Object object;
  object.id = id;
  object.group = random.below(3);
  object.tag = random.next();
  object.layers = static_cast<Layers>(random.below(4));
  object.shape.kind = static_cast<ShapeKind>(random.below(4));
  object.shape.position = random.vector(100);
  if (object.shape.kind == ShapeKind::kBall || object.shape.kind == ShapeKind::kCapsule)
    object.shape.radius = random.float_between(0, 3);
  if (object.shape.kind == ShapeKind::kBox || object.shape.kind == ShapeKind::kCapsule)
    object.shape.size = {random.float_between(0, 4), 1, 2};
  if (random.chance(0.5)) object.shape.rotation = {0, 0, 1, 0};
  return object;
}

void expect_holds(const ObjectSet& set, const std::map<Id, Object>& model) {
  ASSERT_EQ(set.size(), model.size());
  size_t seen = 0;
  set.for_each([&](const Object& object) {
    ++seen;
    EXPECT_EQ(object, model.at(object.id));
  });
  EXPECT_EQ(seen, model.size());
  for (const auto& [id, object] : model) EXPECT_EQ(set.find(id), object) << id;
}

// Every field of an object is returned as stored, whatever else its brick contains and however often the brick is
// rebuilt.
TEST(ObjectStoreTest, SetsEqualAReferenceMapAfterRandomChanges) {
  Random random(11);
  ObjectStore store;
  std::map<Id, Object> model;
  std::vector<std::pair<ObjectSet, std::map<Id, Object>>> kept;
  for (int batch = 0; batch < 300; ++batch) {
    std::vector<Object> removed, added;
    for (int i = 0; i < 20; ++i) {
      const Id id = 1 + random.below(600);
      const auto taken = [id](const Object& object) { return object.id == id; };
      if (std::any_of(added.begin(), added.end(), taken) || std::any_of(removed.begin(), removed.end(), taken))
        continue;
      const auto known = model.find(id);
      if (known != model.end()) removed.push_back(known->second);
      if (known == model.end() || random.chance(0.7)) added.push_back(random_object(id, random));
    }
    store.apply(removed, added);
    for (const Object& object : removed) model.erase(object.id);
    for (const Object& object : added) model[object.id] = object;
    if (batch % 50 == 0) kept.emplace_back(store.snapshot(), model);
  }
  expect_holds(store.snapshot(), model);
  for (const auto& [set, expected] : kept) expect_holds(set, expected);
}

TEST(ObjectStoreTest, MovesOfAFewObjectsLeaveAllOthersUnchanged) {
  Random random(12);
  ObjectStore store;
  std::vector<Object> objects;
  std::map<Id, Object> model;
  for (Id id = 1; id <= 3'000; ++id) {
    Object ball;
    ball.id = id;
    ball.shape = {ShapeKind::kBall, random.vector(10), {}, {}, 0.5f};
    objects.push_back(ball);
    model[id] = ball;
  }
  store.apply({}, objects);
  for (int batch = 0; batch < 400; ++batch) {
    std::vector<GridMove> moves;
    std::vector<Quaternion> rotations;
    for (const Id id : {Id(batch * 7 % 3'000 + 1), Id(batch * 13 % 3'000 + 1)}) {
      if (!moves.empty() && moves[0].handle == store.handle(id)) continue;
      const bool turns = random.chance(0.1);
      Shape& shape = model[id].shape;
      shape.position = random.vector(random.chance(0.2) ? 500 : 10);
      if (turns) shape.rotation = {1, 0, 0, 0};
      moves.push_back({shape.position, store.handle(id)});
      if (!turns) continue;
      moves.back().rotation = static_cast<uint32_t>(rotations.size());
      rotations.push_back(shape.rotation);
    }
    store.move({moves, rotations});
    if (batch % 100 == 0) expect_holds(store.snapshot(), model);
  }
  expect_holds(store.snapshot(), model);
}

TEST(ObjectStoreTest, TheObjectsOfAGroupEqualThoseOfAWalkAfterRandomChanges) {
  Random random(3);
  ObjectStore store;
  for (int step = 0; step < 100; ++step) {
    std::vector<Object> removed, inserted;
    absl::flat_hash_set<Id> replaced;
    for (Id id = 1; id <= 300; ++id) {
      if (!random.chance(0.1)) continue;
      if (const std::optional<Object> known = store.find(id)) removed.push_back(*known);
      if (random.chance(0.3)) continue;
      Object object;
      object.id = id;
      object.group = random.below(6);
      object.shape.position = random.vector(100);
      inserted.push_back(object);
      if (!removed.empty() && removed.back().id == id && random.chance(0.3)) replaced.insert(id);
    }
    store.apply(removed, inserted, replaced);
    const ObjectSet objects = store.snapshot();
    for (Group group = 1; group <= 6; ++group) {
      std::set<Id> walked, listed, stored;
      objects.for_each([&](const Object& object) {
        if (object.group == group) walked.insert(object.id);
      });
      objects.for_each_in(group, [&](const GridRef& object) { return listed.insert(object.entry().id).second; });
      store.for_each_in(group, [&](const Object& object) { stored.insert(object.id); });
      ASSERT_EQ(listed, walked);
      ASSERT_EQ(stored, walked);
      ASSERT_EQ(objects.count_in(group), walked.size());
    }
  }
}

TEST(ObjectStoreTest, AnUnknownIdHasNoHandleAndNoObject) {
  ObjectStore store;
  EXPECT_EQ(store.handle(5), ObjectStore::kNoHandle);
  EXPECT_EQ(store.find(5), std::nullopt);
  EXPECT_EQ(store.snapshot().find(5), std::nullopt);
  EXPECT_FALSE(store.snapshot().find_ref(5));
}

TEST(ObjectStoreTest, AReusedHandleNamesTheNewObjectAndTheOldOneInOlderSets) {
  ObjectStore store;
  Object first, second;
  first.id = 1;
  second.id = 2;
  second.shape.position = {9, 9, 9};
  store.insert(first);
  const ObjectSet before = store.snapshot();
  const uint32_t handle = store.handle(1);
  ASSERT_TRUE(store.remove(first));
  store.insert(second);
  ASSERT_EQ(store.handle(2), handle);
  EXPECT_EQ(before.find(1), first);
  EXPECT_EQ(before.find(2), std::nullopt);
  EXPECT_EQ(store.snapshot().find(1), std::nullopt);
  EXPECT_EQ(store.snapshot().find(2), second);
}

}  // namespace
}  // namespace locus::test
