#include "tests/bench/dynamic/peers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/bench/dynamic/agreement.h"
#include "tests/bench/dynamic/world_run.h"

// Compares every contender, including locus, with a test of all objects one by one.
namespace locus::bench::dynamic {
namespace {

using ::testing::IsEmpty;

constexpr uint32_t kCount = 3000;
constexpr float kCrowded = 300;  // side of a world in which most queries find something

// Returns, for each query, an id that no object has. Every right answer differs from it, so compare() tests all objects
// to decide which answer is right.
Answers wrong_answers(size_t queries) {
  Answers answers;
  answers.ids.assign(queries, 1);
  answers.distances.assign(queries, -1);
  answers.counts.assign(queries, 1);
  return answers;
}

// Verifies the nearest objects of `contender`. A peer may return any of several objects at one distance, so its answers
// are compared with those of locus, and those of locus with a test of all objects.
void expect_right_nearest(Contender& contender, const World& world) {
  if (!contender.does(Task::kNearest)) return;
  const Queries queries = queries_of(world, 20);
  Ours ours;
  ours.load(world.objects());
  Answers our_answers, answers;
  ours.nearest(queries.centers, our_answers);
  contender.nearest(queries.centers, answers);
  Report report;
  compare("case", Task::kNearest, world, queries, our_answers, contender.name(), answers, report);
  EXPECT_THAT(report.disagreements, IsEmpty());
  EXPECT_THAT(report.notes, IsEmpty());
  compare("case", Task::kNearest, world, queries, our_answers, "nobody", wrong_answers(20), report);
  EXPECT_THAT(report.disagreements, testing::ElementsAre(testing::HasSubstr("nobody is wrong")));
}

void expect_right(Contender& contender, const World& world) {
  const Queries queries = queries_of(world, 20);
  for (const Task task : {Task::kBall, Task::kBox, Task::kRay}) {
    if (!contender.does(task)) continue;
    Answers answers;
    if (task == Task::kBall) contender.balls(queries.centers, answers);
    if (task == Task::kBox) contender.boxes(queries.centers, answers);
    if (task == Task::kRay) contender.rays(queries.rays, answers);
    Report report;
    compare("case", task, world, queries, answers, "nobody", wrong_answers(20), report);
    ASSERT_EQ(report.disagreements.size(), 1u) << contender.name();
    EXPECT_THAT(report.disagreements[0], testing::HasSubstr("nobody is wrong")) << contender.name();
  }
  expect_right_nearest(contender, world);
}

TEST(PeersTest, LoadedObjectsAreFound) {
  const World world(Kind::kUniform, kCount, kCrowded);
  for (const Maker& maker : makers_for(world)) {
    const std::unique_ptr<Contender> contender = maker.make();
    contender->load(world.objects());
    expect_right(*contender, world);
  }
}

TEST(PeersTest, MovedObjectsAreFoundAtTheirNewPositions) {
  World world(Kind::kBorder, kCount, kCrowded);
  std::vector<std::unique_ptr<Contender>> contenders;
  for (const Maker& maker : makers_for(world)) {
    contenders.push_back(maker.make());
    contenders.back()->load(world.objects());
  }
  for (int tick = 0; tick < 3; ++tick) {
    world.step();
    for (const auto& contender : contenders) contender->move(world.moves());
  }
  for (const auto& contender : contenders) expect_right(*contender, world);
}

TEST(PeersTest, RemovedObjectsAreNotFoundAndReinsertedOnesAre) {
  const World world(Kind::kUniform, kCount, kCrowded);
  const Objects all = world.objects();
  const Objects some = {all.ids.subspan(100, 500), all.positions.subspan(300, 1500), all.radii.subspan(100, 500)};
  for (const Maker& maker : makers_for(world)) {
    const std::unique_ptr<Contender> contender = maker.make();
    if (!contender->does(Task::kReinsert)) continue;
    contender->load(all);
    contender->remove(some.ids);
    Answers answers;
    for (size_t i = 0; i < 20; ++i) {
      const Vec3f center = point_at(some.positions, i);
      contender->balls(absl::MakeConstSpan(&center, 1), answers);
    }
    for (const uint64_t id : some.ids) EXPECT_THAT(answers.ids, testing::Not(testing::Contains(id)));
    contender->insert(some);
    expect_right(*contender, world);
  }
}

TEST(PeersTest, PeersOfOneSizeAreLeftOutOfWorldsWithSeveral) {
  const auto names = [](Kind kind) {
    std::vector<std::string> result;
    for (const Maker& maker : makers_for(World(kind, 10))) result.push_back(maker.name);
    return result;
  };
  EXPECT_THAT(names(Kind::kUniform), testing::Contains("flat_hash_map"));
  EXPECT_THAT(names(Kind::kGiant), testing::Not(testing::Contains("flat_hash_map")));
  EXPECT_EQ(names(Kind::kGiant).front(), "locus");
}

TEST(PeersTest, PeersOfAllSizesFindTheGiant) {
  const World world(Kind::kGiant, kCount, kCrowded);
  for (const Maker& maker : makers_for(world)) {
    const std::unique_ptr<Contender> contender = maker.make();
    contender->load(world.objects());
    expect_right(*contender, world);
  }
}

TEST(PeersTest, ABatchHasTheAnswersOfTheIndex) {
  const World world(Kind::kMixed, kCount, kCrowded);
  Ours ours;
  ours.load(world.objects());
  const Queries queries = queries_of(world, 50);
  const std::unique_ptr<Contender> batches = batches_of(ours);
  for (const Task task : {Task::kBall, Task::kBox, Task::kRay, Task::kNearest}) {
    Answers alone, whole;
    for (auto [contender, answers] : {std::pair<Contender*, Answers*>{&ours, &alone}, {batches.get(), &whole}}) {
      if (task == Task::kBall) contender->balls(queries.centers, *answers);
      if (task == Task::kBox) contender->boxes(queries.centers, *answers);
      if (task == Task::kRay) contender->rays(queries.rays, *answers);
      if (task == Task::kNearest) contender->nearest(queries.centers, *answers);
    }
    Report report;
    compare("case", task, world, queries, alone, "batch", whole, report);
    EXPECT_THAT(report.disagreements, IsEmpty());
    EXPECT_THAT(report.notes, IsEmpty());
  }
}

}  // namespace
}  // namespace locus::bench::dynamic
