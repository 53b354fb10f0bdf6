#include "client/cli/rows/scene_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/rows/part_list.h"

namespace locus::cli {
namespace {

// Appends the object or instance `id`, with default values, to the columns that Insert and Placement have in common.
template <class Run>
void fill_shared(Run& run, uint64_t id) {
  run.add_ids(id);
  for (const float part : {0.f, 0.f, 0.f, 1.f}) run.add_rotations(part);
  run.add_layers(1);
  run.add_groups(0);
  run.add_tags(0);
}

// Returns a message of a dump with a ball, a box, a capsule, a point and an instance.
v1::DumpSceneResponse one_of_each() {
  v1::DumpSceneResponse message;
  for (uint64_t id = 1; id <= 4; ++id) {
    v1::Insert& run = *message.add_objects();
    fill_shared(run, id);
    for (const double part : {0.1, 2.0, 3.0}) run.add_positions_f64(part);
  }
  message.mutable_objects(0)->mutable_ball()->add_radii(0.5f);
  message.mutable_objects(2)->mutable_capsule()->add_radii(0.25f);
  for (const float part : {1.f, 2.f, 3.f}) {
    message.mutable_objects(1)->mutable_box()->add_half_extents(part);
    message.mutable_objects(2)->mutable_capsule()->add_half_axes(part);
  }
  message.mutable_objects(3)->mutable_point();
  v1::Placement& place = *message.add_instances();
  place.set_mesh("crate");
  fill_shared(place, 5);
  for (const double part : {4.0, 5.0, 6.0}) place.add_translations(part);
  place.add_scales(2);
  return message;
}

absl::Status read(const v1::DumpSceneResponse& message) {
  return for_each_thing(message, [](const SceneThing&) { return absl::OkStatus(); });
}

TEST(SceneRowsTest, ThingsComeInOrderWithTheirValues) {
  std::vector<SceneThing> things;
  ASSERT_TRUE(for_each_thing(one_of_each(), [&](const SceneThing& thing) {
                things.push_back(thing);
                return absl::OkStatus();
              }).ok());
  ASSERT_EQ(things.size(), 5u);
  const std::vector<ThingKind> kinds = {ThingKind::kBall, ThingKind::kBox, ThingKind::kCapsule, ThingKind::kPoint,
                                        ThingKind::kInstance};
  for (size_t i = 0; i < things.size(); ++i) {
    EXPECT_EQ(things[i].id, i + 1);
    EXPECT_EQ(things[i].kind, kinds[i]);
  }
  EXPECT_EQ(things[0].at[0], 0.1);
  EXPECT_EQ(things[1].size[2], 3);
  EXPECT_EQ(things[2].radius, 0.25f);
  EXPECT_EQ(things[4].mesh, "crate");
  EXPECT_EQ(things[4].scale, 2);
}

TEST(SceneRowsTest, CompoundsHaveTheirPartsInARow) {
  v1::DumpSceneResponse message;
  v1::Insert& run = *message.add_objects();
  fill_shared(run, 9);
  for (const double part : {1.0, 2.0, 3.0}) run.add_positions_f64(part);
  *run.mutable_compound() = client::Compound()
                                .ball({0, 0, 2}, 0.5f, {.layers = 2})
                                .capsule({0, 0, 1}, {0, 0, 0.5f}, 0.25f, {.rotation = {0, 0, 1, 0}})
                                .message();
  Json row;
  ASSERT_TRUE(for_each_thing(message, [&](const SceneThing& thing) {
                row = thing_row(thing, Things::kObjects);
                return absl::OkStatus();
              }).ok());
  EXPECT_EQ(row["shape"], "compound");
  EXPECT_EQ(row["parts"].dump(),
            R"([{"ball":0.5,"at":[0.0,0.0,2.0],"rotation":[0.0,0.0,0.0,1.0],"layers":2},)"
            R"({"capsule":{"axis":[0.0,0.0,0.5],"radius":0.25},"at":[0.0,0.0,1.0],"rotation":[0.0,0.0,1.0,0.0],)"
            R"("layers":4294967295}])");
  const absl::StatusOr<client::Compound> again = read_parts(row["parts"].dump());
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(parts_json(again->message()), row["parts"]);
  run.mutable_compound()->mutable_parts(1)->mutable_capsule()->clear_radii();
  EXPECT_TRUE(absl::IsDataLoss(read(message)));
}

TEST(SceneRowsTest, ReadingEndsAtTheFirstError) {
  int taken = 0;
  EXPECT_EQ(
      for_each_thing(one_of_each(),
                     [&](const SceneThing&) { return ++taken == 2 ? absl::AbortedError("enough") : absl::OkStatus(); }),
      absl::AbortedError("enough"));
  EXPECT_EQ(taken, 2);
}

TEST(SceneRowsTest, ColumnsOfWrongLengthAreDataLoss) {
  const v1::DumpSceneResponse intact = one_of_each();
  ASSERT_TRUE(read(intact).ok());
  std::vector<v1::DumpSceneResponse> damaged(9, intact);
  damaged[0].mutable_objects(0)->add_positions_f64(0);
  damaged[1].mutable_objects(0)->clear_rotations();
  damaged[2].mutable_objects(0)->add_layers(0);
  damaged[3].mutable_objects(0)->mutable_ball()->clear_radii();
  damaged[4].mutable_objects(1)->mutable_box()->add_half_extents(0);
  damaged[5].mutable_objects(2)->mutable_capsule()->clear_radii();
  damaged[6].mutable_objects(3)->clear_point();
  damaged[7].mutable_instances(0)->clear_scales();
  damaged[8].mutable_instances(0)->clear_tags();
  for (const v1::DumpSceneResponse& message : damaged) EXPECT_TRUE(absl::IsDataLoss(read(message)));
}

TEST(SceneRowsTest, RowsHaveOnlyTheKeysOfThingKeysInTheirOrder) {
  for (const Things things : {Things::kAll, Things::kObjects, Things::kInstances}) {
    const std::vector<std::string>& keys = thing_keys(things);
    ASSERT_TRUE(for_each_thing(one_of_each(), [&](const SceneThing& thing) {
                  if (!is_among(things, thing.kind)) return absl::OkStatus();
                  size_t next = 0;
                  const Json row = thing_row(thing, things);
                  for (const auto& [key, value] : row.items()) {
                    const auto found = std::find(keys.begin() + static_cast<ptrdiff_t>(next), keys.end(), key);
                    EXPECT_NE(found, keys.end()) << key << " is unknown or out of order";
                    next = static_cast<size_t>(found - keys.begin());
                  }
                  return absl::OkStatus();
                }).ok());
  }
}

}  // namespace
}  // namespace locus::cli
