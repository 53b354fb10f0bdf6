// Compares the culling kernels of every instruction set with a test in double: a kernel must keep each value that
// passes this test by at least an epsilon, and must drop each value that fails this test by more than an epsilon.
#include "core/index/hash_grid/kernels/grid_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "core/base/instruction_set.h"
#include "core/index/hash_grid/kernels/grid_dispatch.h"
#include "tests/support/random.h"

namespace locus::test {
namespace {

// Columns of one block, with eight unused values at the end, since kernels read whole vectors.
struct Columns4 {
  explicit Columns4(size_t values) : count(static_cast<uint32_t>(values)) {
    for (std::vector<float>* column : {&x, &y, &z, &extent}) column->resize(values + 8);
    dead.resize(values / 64 + 2);
  }
  GridRows rows() const { return {x.data(), y.data(), z.data(), extent.data(), nullptr, 0, {}, {}}; }

  uint32_t count;
  std::vector<float> x, y, z, extent;
  std::vector<uint64_t> dead;
};

Columns4 random_columns(size_t values, Random& random) {
  Columns4 columns(values);
  for (size_t i = 0; i < values; ++i) {
    columns.x[i] = random.float_between(-10, 10);
    columns.y[i] = random.float_between(-10, 10);
    columns.z[i] = random.float_between(-10, 10);
    columns.extent[i] = random.float_between(0, 2);
  }
  return columns;
}

class GridKernelsTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(use_instruction_set(GetParam()).ok()); }
  void TearDown() override { ASSERT_TRUE(use_instruction_set("").ok()); }

  // Runs the kernel run(rows, slots) on random rows and compares the slots that it keeps with keep(slot): 1 = must be
  // kept, 0 = may be kept, -1 = must not be kept. Compares the marks of the kept slots with inside(slot) in the same
  // way.
  template <class Run, class Keep, class Inside>
  static void expect_kept(Columns4& columns, Random& random, const Run& run, const Keep& keep, const Inside& inside) {
    for (int round = 0; round < 200; ++round) {
      GridRows rows = columns.rows();
      std::set<uint32_t> live;
      const bool some_dead = random.chance(0.5);
      for (uint64_t& word : columns.dead) word = some_dead ? random.next() & random.next() : 0;
      if (some_dead) rows.dead = columns.dead.data();
      uint32_t at = 0;
      while (rows.count < GridRows::kMax && at < columns.count) {
        const auto begin = static_cast<uint32_t>(at + random.below(12));
        const auto end = std::min(columns.count, static_cast<uint32_t>(begin + 1 + random.below(30)));
        if (begin >= end) break;
        rows.begin[rows.count] = begin;
        rows.end[rows.count++] = end;
        for (uint32_t slot = begin; slot < end; ++slot)
          if ((columns.dead[slot / 64] >> (slot % 64) & 1) == 0) live.insert(slot);
        at = end;
      }
      uint32_t slots[GridRows::kMaxValues + 8];
      const uint32_t count = run(rows, slots);
      for (uint32_t* slot = slots; slot != slots + count; ++slot) {
        const int is_inside = inside(*slot & ~kInsideMark);
        ASSERT_TRUE((*slot & kInsideMark) != 0 ? is_inside >= 0 : is_inside <= 0) << *slot;
        *slot &= ~kInsideMark;
      }
      ASSERT_TRUE(std::is_sorted(slots, slots + count));
      const std::set<uint32_t> kept(slots, slots + count);
      ASSERT_EQ(kept.size(), count);
      for (const uint32_t slot : kept) ASSERT_TRUE(live.contains(slot) && keep(slot) >= 0) << slot;
      for (const uint32_t slot : live) ASSERT_TRUE(keep(slot) <= 0 || kept.contains(slot)) << slot;
    }
  }
};

// Returns 1 if `distance` is less than `extent` by at least an epsilon, -1 if `distance` is greater than `extent` by
// more than an epsilon, and 0 otherwise.
int verdict(double distance, double extent) {
  constexpr double kEpsilon = 1e-4;
  return distance <= extent - kEpsilon ? 1 : distance > extent + kEpsilon ? -1 : 0;
}

// Verdict on the marks of a kernel that marks no slots.
int never(uint32_t) { return -1; }

TEST_P(GridKernelsTest, CullBoxKeepsTheValuesThatMeetTheBoxAndMarkBoxMarksThoseInside) {
  Random random(1);
  Columns4 columns = random_columns(300, random);
  const GridBox box{{-3, -2, 0}, {4, 5, 1}, {-2, -1, 0.25f}, {3, 4, 0.75f}};
  // Returns the largest signed distance of the position of a value from a side of a box.
  const auto outside = [&](uint32_t slot, const float* low, const float* high) {
    double worst = -1e9;
    const double at[] = {columns.x[slot], columns.y[slot], columns.z[slot]};
    for (int axis = 0; axis < 3; ++axis)
      worst = std::max({worst, double{low[axis]} - at[axis], at[axis] - double{high[axis]}});
    return worst;
  };
  const auto keep = [&](uint32_t slot) { return verdict(outside(slot, box.low, box.high), columns.extent[slot]); };
  expect_kept(
      columns, random,
      [&](const GridRows& rows, uint32_t* slots) { return active_grid_kernels().cull_box(rows, box, slots); }, keep,
      never);
  expect_kept(
      columns, random,
      [&](const GridRows& rows, uint32_t* slots) { return active_grid_kernels().mark_box(rows, box, slots); }, keep,
      [&](uint32_t slot) { return verdict(outside(slot, box.inner_low, box.inner_high), 0); });
}

TEST_P(GridKernelsTest, CullBallKeepsTheValuesThatMeetTheBallAndMarkBallMarksThoseInside) {
  Random random(2);
  Columns4 columns = random_columns(300, random);
  const GridBall ball{{1, -2, 3}, 4, 3};
  const auto distance = [&](uint32_t slot) {
    const double x = columns.x[slot] - 1.0, y = columns.y[slot] + 2.0, z = columns.z[slot] - 3.0;
    return std::sqrt(x * x + y * y + z * z);
  };
  const auto keep = [&](uint32_t slot) { return verdict(distance(slot), 4.0 + columns.extent[slot]); };
  expect_kept(
      columns, random,
      [&](const GridRows& rows, uint32_t* slots) { return active_grid_kernels().cull_ball(rows, ball, slots); }, keep,
      never);
  expect_kept(
      columns, random,
      [&](const GridRows& rows, uint32_t* slots) { return active_grid_kernels().mark_ball(rows, ball, slots); }, keep,
      [&](uint32_t slot) { return verdict(distance(slot), 3); });
}

TEST_P(GridKernelsTest, CullLineKeepsTheValuesThatMeetThePartOfTheLine) {
  Random random(3);
  Columns4 columns = random_columns(300, random);
  for (const auto& [from, to] : {std::pair(-1e30f, 1e30f), std::pair(-2.0f, 1e30f), std::pair(-2.0f, 1.5f)}) {
    const GridLine line{{1, 2, 0}, {0.6f, 0, 0.8f}, 0.5f, from, to};
    const auto keep = [&](uint32_t slot) {
      const double x = columns.x[slot] - 1.0, y = columns.y[slot] - 2.0, z = columns.z[slot];
      const double along = x * 0.6 + z * 0.8, extent = 0.5 + double{kDiagonal} * columns.extent[slot];
      const double off_x = x - along * 0.6, off_z = z - along * 0.8;
      return std::min({verdict(std::sqrt(off_x * off_x + y * y + off_z * off_z), extent),
                       verdict(line.from, along + extent), verdict(along - extent, line.to)});
    };
    expect_kept(
        columns, random,
        [&](const GridRows& rows, uint32_t* slots) { return active_grid_kernels().cull_line(rows, line, slots); }, keep,
        never);
  }
}

TEST_P(GridKernelsTest, CollectNearReturnsTheValuesOfTheShellAndTheirKeys) {
  Random random(4);
  Columns4 columns = random_columns(300, random);
  const GridNear near{{1, -2, 3}, 0.01f, 4, 50};
  const auto key_of = [&](uint32_t slot) {
    const double gaps[] = {std::fabs(columns.x[slot] - 1.0), std::fabs(columns.y[slot] + 2.0),
                           std::fabs(columns.z[slot] - 3.0)};
    double key = 0;
    for (const double gap : gaps) {
      const double beyond = std::max(0.0, gap - columns.extent[slot] - 0.01);
      key += beyond * beyond;
    }
    return key;
  };
  const auto keep = [&](uint32_t slot) { return std::min(verdict(4, key_of(slot)), verdict(key_of(slot), 50)); };
  const auto run = [&](const GridRows& rows, uint32_t* slots) {
    float keys[GridRows::kMaxValues + 8];
    const uint32_t count = active_grid_kernels().collect_near(rows, near, slots, keys);
    for (uint32_t i = 0; i < count; ++i) EXPECT_NEAR(double{keys[i]}, key_of(slots[i]), 1e-4);
    return count;
  };
  expect_kept(columns, random, run, keep, never);
}

TEST_P(GridKernelsTest, CollectNearAcceptsLongAndEmptyRows) {
  Random random(5);
  Columns4 columns = random_columns(500, random);
  GridRows rows = columns.rows();
  rows.count = 3;
  rows.begin[0] = rows.end[0] = 3;
  rows.begin[1] = 3, rows.end[1] = 499;
  rows.begin[2] = rows.end[2] = 499;
  const GridNear everything{{}, 0, -1, 1e9f};
  uint32_t slots[GridRows::kMaxValues + 8];
  float keys[GridRows::kMaxValues + 8];
  ASSERT_EQ(active_grid_kernels().collect_near(rows, everything, slots, keys), 496u);
  for (uint32_t i = 0; i < 496; ++i) EXPECT_EQ(slots[i], i + 3);
}

TEST_P(GridKernelsTest, SortFewSortsAnyCountOfDistinctValues) {
  Random random(6);
  for (uint32_t count = 0; count <= kMaxSorted; ++count) {
    std::vector<int32_t> numbers;
    for (uint32_t i = 0; i < count; ++i)
      numbers.push_back(static_cast<int32_t>(random.next() & 0x7FFFFF00u) | static_cast<int32_t>(i));
    std::vector<int32_t> sorted = numbers;
    std::sort(sorted.begin(), sorted.end());
    active_grid_kernels().sort_few(numbers.data(), count);
    EXPECT_EQ(numbers, sorted);
  }
}

INSTANTIATE_TEST_SUITE_P(InstructionSets, GridKernelsTest, ::testing::ValuesIn(instruction_sets()));

}  // namespace
}  // namespace locus::test
