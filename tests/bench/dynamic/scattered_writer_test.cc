#include "tests/bench/dynamic/scattered_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <utility>

namespace locus::bench::dynamic {
namespace {

// A contender that only stores the positions of objects.
class Memory : public Contender {
 public:
  Memory() : Contender("memory") {}
  bool does(Task) const override { return true; }
  void load(const Objects&) override {}
  void move(const Moves& moves) override {
    for (size_t i = 0; i < moves.ids.size(); ++i) places[moves.ids[i]] = point_at(moves.positions, i);
  }
  std::map<uint64_t, Vec3f> places;
};

TEST(ScatteredWriterTest, MovesEveryObjectToTheNextTickAndThenBack) {
  World world(Kind::kUniform, 1000);
  const World before = world;
  ScatteredWriter writer(world);
  Memory memory;
  for (const World* const expected : {&std::as_const(world), &before}) {
    for (int batch = 0; batch < 10; ++batch) writer.move(memory, 100);
    ASSERT_EQ(memory.places.size(), 1000u);
    for (uint32_t i = 0; i < 1000; ++i)
      EXPECT_EQ(memory.places[world.objects().ids[i]], point_at(expected->objects().positions, i)) << i;
  }
}

TEST(ScatteredWriterTest, NeighboursInABatchAreFarApartInTheOrderOfObjects) {
  World world(Kind::kUniform, 10'000);
  ScatteredWriter writer(world);
  Memory memory;
  writer.move(memory, 2);
  EXPECT_EQ(memory.places.count(world.objects().ids[0]), 1u);
  EXPECT_EQ(memory.places.count(world.objects().ids[7919]), 1u);
}

}  // namespace
}  // namespace locus::bench::dynamic
