// Tests trees that follow single changes: a changed tree answers like a list of its values, its source stays as it was,
// and both share the blocks that did not change.
#include "core/index/bvh/bvh_change.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/support/index_judge.h"
#include "tests/support/random.h"

namespace locus::test {
namespace {

// Returns a small triangle at `center`.
Triangle triangle_at(Vec3f center, uint32_t number) {
  return {center, center + Vec3f{1, 0, 0}, center + Vec3f{0, 1, 1}, number};
}

Vec3f random_center(Random& random, double size) {
  return to_float(Vec3d{random.between(0, size), random.between(0, size), random.between(0, size)});
}

// A tree, and the same triangles in a map.
class Pair {
 public:
  explicit Pair(std::vector<Triangle> triangles) {
    for (const Triangle& triangle : triangles) values_[triangle.number] = triangle;
    set(*Bvh<Triangle>::build(std::move(triangles)));
  }

  const Bvh<Triangle>& tree() const { return tree_; }
  const std::map<uint32_t, Triangle>& values() const { return values_; }
  uint32_t position(uint32_t number) const { return positions_.at(number); }

  void change(BvhChange<Triangle> change) {
    for (const uint32_t position : change.removed) values_.erase(tree_.at(position).number);
    for (const auto& one : change.replaced) values_[one.value.number] = one.value;
    for (const Triangle& triangle : change.added) values_[triangle.number] = triangle;
    absl::StatusOr<Bvh<Triangle>::Changed> changed = tree_.change(std::move(change));
    ASSERT_TRUE(changed.ok()) << changed.status();
    // Values outside of the listed blocks keep their positions.
    std::map<uint32_t, uint32_t> positions = positions_;
    std::erase_if(positions, [this](const auto& entry) { return !values_.contains(entry.first); });
    for (const uint32_t block : changed->blocks) {
      uint32_t position = block * kBvhBlockValues;
      for (const Triangle& triangle : changed->tree.block(block)) positions[triangle.number] = position++;
    }
    set(std::move(changed->tree));
    ASSERT_EQ(positions, positions_);
  }

  // Returns the first difference between the tree and a list of its values, for random queries.
  std::string difference(Random& random, double size) const {
    TestScene<Triangle> queries;
    for (const auto& [number, triangle] : values_) queries.values.push_back(triangle);
    for (int i = 0; i < 20; ++i) {
      queries.rays.emplace_back(to_double(random_center(random, size)), random.unit_vector());
      queries.balls.push_back({random_center(random, size), static_cast<float>(random.between(0, size / 4))});
      const Vec3f half = random_center(random, size / 8);
      queries.boxes.push_back({random_center(random, size), half, rotation_of(random.rotation())});
    }
    const auto list = make_list(queries.values);
    return IndexJudge(tree_, list).difference(queries);
  }

 private:
  void set(Bvh<Triangle> tree) {
    tree_ = std::move(tree);
    positions_.clear();
    for (uint32_t block = 0; block < tree_.block_count(); ++block) {
      uint32_t position = block * kBvhBlockValues;
      for (const Triangle& triangle : tree_.block(block)) {
        EXPECT_EQ(tree_.at(position), triangle);
        EXPECT_EQ(values_.at(triangle.number), triangle);
        positions_[triangle.number] = position++;
      }
    }
    EXPECT_EQ(tree_.size(), values_.size());
    EXPECT_EQ(positions_.size(), values_.size());
  }

  Bvh<Triangle> tree_;
  std::map<uint32_t, Triangle> values_;
  std::map<uint32_t, uint32_t> positions_;
};

std::vector<Triangle> random_triangles(uint32_t count, double size, Random& random) {
  std::vector<Triangle> triangles;
  for (uint32_t i = 0; i < count; ++i) triangles.push_back(triangle_at(random_center(random, size), i + 1));
  return triangles;
}

TEST(BvhChangeTest, ATreeAnswersLikeAListAfterEachOfManyRandomChanges) {
  constexpr double kSize = 50;
  for (const uint32_t count : {0u, 1u, 9u, 70u, 1'500u}) {
    SCOPED_TRACE(count);
    Random random(count + 1);
    Pair pair(random_triangles(count, kSize, random));
    uint32_t next = count + 1;
    for (int step = 0; step < 40; ++step) {
      BvhChange<Triangle> change;
      const double share = random.chance(0.2) ? 0.3 : 0.01;
      // Some steps leave, some move by little, some by much, and some move everything to one place.
      const double jump = random.chance(0.2) ? kSize : 0.5;
      for (const auto& [number, triangle] : pair.values()) {
        if (random.chance(share / 2)) {
          change.removed.push_back(pair.position(number));
        } else if (random.chance(share)) {
          const Vec3f center = triangle.a + random_center(random, jump) - to_float(Vec3d{1, 1, 1} * (jump / 2));
          change.replaced.push_back({pair.position(number), triangle_at(center, number)});
        }
      }
      const uint64_t added = random.chance(0.1) ? 300 : random.below(5);
      const double spread = random.chance(0.5) ? kSize : 1;
      for (uint64_t i = 0; i < added; ++i) change.added.push_back(triangle_at(random_center(random, spread), next++));
      ASSERT_NO_FATAL_FAILURE(pair.change(std::move(change)));
      ASSERT_EQ(pair.difference(random, kSize), "") << "step " << step;
    }
  }
}

TEST(BvhChangeTest, TheSourceOfAChangeStaysAsItWas) {
  Random random(3);
  const Pair before(random_triangles(500, 20, random));
  Pair after = before;
  BvhChange<Triangle> change;
  for (uint32_t number = 1; number < 100; ++number) change.removed.push_back(before.position(number));
  for (uint32_t number = 200; number < 300; ++number)
    change.replaced.push_back({before.position(number), triangle_at({90, 90, 90}, number)});
  after.change(std::move(change));
  EXPECT_EQ(before.difference(random, 20), "");
  EXPECT_EQ(before.tree().size(), 500u);
  EXPECT_EQ(after.tree().size(), 401u);
}

TEST(BvhChangeTest, AChangeOfOneValueSharesAllButOneBlock) {
  Random random(4);
  const Pair before(random_triangles(20'000, 100, random));
  const auto apart = [&before](const Pair& after) {
    size_t values = 0;
    after.tree().for_each_apart_from(before.tree(), [&values](const Triangle&) { ++values; });
    return values;
  };
  Pair moved = before, placed = before, removed = before;
  const Triangle triangle = before.values().at(77);
  BvhChange<Triangle> move, place, remove;
  move.replaced.push_back({before.position(77), triangle_at(triangle.a + Vec3f{0.1f, 0, 0}, 77)});
  place.added.push_back(triangle_at({50, 50, 50}, 99'999));
  remove.removed.push_back(before.position(77));
  moved.change(std::move(move));
  placed.change(std::move(place));
  removed.change(std::move(remove));
  EXPECT_LE(apart(moved), kBvhBlockValues);
  EXPECT_LE(apart(placed), 2 * kBvhBlockValues);
  EXPECT_LE(apart(removed), kBvhBlockValues);
  EXPECT_LT(moved.tree().unshared_bytes(before.tree()), before.tree().bytes() / 4);
}

TEST(BvhChangeTest, ATreeOfWhichFewValuesAreLeftHasFewBlocks) {
  Random random(6);
  Pair pair(random_triangles(20'000, 100, random));
  while (pair.values().size() > 300) {
    std::vector<uint32_t> numbers;
    for (const auto& [number, triangle] : pair.values()) numbers.push_back(number);
    BvhChange<Triangle> change;
    for (size_t i = 0; i < numbers.size() / 20; ++i) {
      std::swap(numbers[i], numbers[i + random.below(numbers.size() - i)]);
      change.removed.push_back(pair.position(numbers[i]));
    }
    ASSERT_NO_FATAL_FAILURE(pair.change(std::move(change)));
    std::vector<Triangle> values;
    for (const auto& [number, triangle] : pair.values()) values.push_back(triangle);
    ASSERT_LE(pair.tree().block_count(), 16 + 8 * Bvh<Triangle>::build(std::move(values))->block_count());
  }
  EXPECT_EQ(pair.difference(random, 100), "");
}

TEST(BvhChangeTest, ATreeWhoseValuesWanderIsBuiltAgainBeforeItDegrades) {
  Random random(5);
  Pair pair(random_triangles(2'000, 100, random));
  for (int step = 0; step < 60; ++step) {
    BvhChange<Triangle> change;
    for (const auto& [number, triangle] : pair.values()) {
      const Vec3f center = triangle.a + to_float(random.unit_vector() * 10);
      change.replaced.push_back({pair.position(number), triangle_at(center, number)});
    }
    ASSERT_NO_FATAL_FAILURE(pair.change(std::move(change)));
    std::vector<Triangle> values;
    for (const auto& [number, triangle] : pair.values()) values.push_back(triangle);
    ASSERT_LT(pair.tree().sah_cost(), 2 * Bvh<Triangle>::build(std::move(values))->sah_cost()) << "step " << step;
  }
}

}  // namespace
}  // namespace locus::test
