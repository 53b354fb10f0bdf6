#include "core/index/bvh/bvh_build.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "tests/support/random.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

template <class S>
BvhLayout<S> build(const std::vector<Aabb<S>>& boxes, int bins = 32) {
  BvhOptions options;
  options.bins = bins;
  absl::StatusOr<BvhLayout<S>> layout = build_bvh_layout<S>(boxes, options);
  EXPECT_TRUE(layout.ok()) << layout.status();
  return layout.ok() ? *std::move(layout) : BvhLayout<S>();
}

// Checker of a tree's layout: visits all nodes and verifies the documented properties of the layout.
template <class S>
class LayoutChecker {
 public:
  LayoutChecker(const BvhLayout<S>& layout, const std::vector<Aabb<S>>& boxes) : layout_(layout), boxes_(boxes) {}

  void check() {
    check_order();
    if (boxes_.empty()) {
      EXPECT_TRUE(layout_.nodes.empty());
      return;
    }
    // Visits nodes depth-first: the indices of nodes and the positions of values must ascend.
    struct Pending {
      BvhChild child;
      Aabb<S> bounds;
      uint32_t depth;
    };
    std::vector<Pending> pending = {{{0, 0}, layout_.bounds, 1}};
    while (!pending.empty()) {
      const Pending now = pending.back();
      pending.pop_back();
      if (now.child.is_leaf()) {
        check_leaf(now.child, now.bounds);
        continue;
      }
      ASSERT_EQ(now.child.first, nodes_seen_++);
      max_depth_ = std::max(max_depth_, now.depth);
      const BvhNode<S>& node = layout_.nodes[now.child.first];
      ASSERT_GE(node.child_count, boxes_.size() > kBvhLeafSize ? 2u : 1u);
      ASSERT_LE(node.child_count, kBvhWidth);
      for (uint32_t slot = node.child_count; slot-- > 0;) {
        ASSERT_TRUE(contains(now.bounds, node.bounds[slot]));
        pending.push_back({node.children[slot], node.bounds[slot], now.depth + 1});
      }
    }
    EXPECT_EQ(nodes_seen_, layout_.nodes.size());
    EXPECT_EQ(positions_seen_, boxes_.size());
    EXPECT_EQ(max_depth_, layout_.depth);
    EXPECT_LE(layout_.depth, limits::kMaxBvhDepth);
    EXPECT_LT(layout_.nodes.size(), 2 * boxes_.size());
  }

 private:
  void check_order() {
    std::vector<uint32_t> sorted = layout_.order, expected(boxes_.size());
    std::sort(sorted.begin(), sorted.end());
    std::iota(expected.begin(), expected.end(), 0u);
    EXPECT_EQ(sorted, expected) << "the order is not a permutation";
  }

  void check_leaf(BvhChild leaf, const Aabb<S>& bounds) {
    ASSERT_EQ(leaf.first, positions_seen_);
    ASSERT_LE(leaf.count, kBvhLeafSize);
    positions_seen_ += leaf.count;
    for (uint32_t i = 0; i < leaf.count; ++i) ASSERT_TRUE(contains(bounds, boxes_[layout_.order[leaf.first + i]]));
  }

  const BvhLayout<S>& layout_;
  const std::vector<Aabb<S>>& boxes_;
  size_t nodes_seen_ = 0, positions_seen_ = 0;
  uint32_t max_depth_ = 0;
};

template <class S>
void expect_valid(const std::vector<Aabb<S>>& boxes) {
  for (const int bins : {2, 5, 32, 64}) {
    SCOPED_TRACE(std::to_string(boxes.size()) + " boxes, " + std::to_string(bins) + " bins");
    const BvhLayout<S> layout = build(boxes, bins);
    LayoutChecker<S>(layout, boxes).check();
  }
}

template <class S>
std::vector<Aabb<S>> random_boxes(size_t count, uint64_t seed) {
  Random random(seed);
  std::vector<Aabb<S>> boxes;
  for (size_t i = 0; i < count; ++i) {
    const Vec3d low = random.vector(100), high = low + random.positive_vector(1);
    boxes.push_back({{S(low.x), S(low.y), S(low.z)}, {S(high.x), S(high.y), S(high.z)}});
  }
  return boxes;
}

template <class S>
Aabb<S> point_box(S x, S y, S z) {
  return {{x, y, z}, {x, y, z}};
}

template <class S>
class BvhBuildTest : public ::testing::Test {};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(BvhBuildTest, Scalars);

TYPED_TEST(BvhBuildTest, SmallAndOrdinaryInputsGiveValidTrees) {
  for (const size_t count : {0, 1, 2, 7, 8, 9, 16, 17, 64, 65, 1000})
    expect_valid(random_boxes<TypeParam>(count, count));
}

TYPED_TEST(BvhBuildTest, NoBoxesGiveNoNodes) {
  const BvhLayout<TypeParam> layout = build<TypeParam>({});
  EXPECT_TRUE(layout.nodes.empty());
  EXPECT_EQ(layout.depth, 0u);
  EXPECT_TRUE(layout.bounds.empty());
}

TYPED_TEST(BvhBuildTest, OneBoxGivesOneNodeWithOneLeaf) {
  const BvhLayout<TypeParam> layout = build(random_boxes<TypeParam>(1, 3));
  ASSERT_EQ(layout.nodes.size(), 1u);
  EXPECT_EQ(layout.depth, 1u);
  EXPECT_EQ(layout.nodes[0].child_count, 1u);
}

TYPED_TEST(BvhBuildTest, ManyBoxesGiveAValidTree) { expect_valid(random_boxes<TypeParam>(scaled_count(100'000), 1)); }

TYPED_TEST(BvhBuildTest, CoincidentBoxesGiveAShallowTree) {
  const size_t count = scaled_count(100'000);
  const std::vector<Aabb<TypeParam>> boxes(count, {{1, 2, 3}, {4, 5, 6}});
  expect_valid(boxes);
  // A tree whose nodes are all full has log8(count / 8) levels; the tree may have twice as many.
  const double ideal = std::log2(static_cast<double>(count) / 8) / 3;
  EXPECT_LE(build(boxes).depth, static_cast<uint32_t>(std::ceil(2 * ideal)));
}

TYPED_TEST(BvhBuildTest, CoincidentPointsAreHalved) {
  expect_valid(std::vector<Aabb<TypeParam>>(1000, point_box<TypeParam>(0, 0, 0)));
}

TYPED_TEST(BvhBuildTest, ExponentialSpacingStaysWithinTheDepthLimit) {
  constexpr int kExponents = std::numeric_limits<TypeParam>::max_exponent - 2;
  std::vector<Aabb<TypeParam>> boxes;
  for (int copy = 0; copy < 30; ++copy) {
    for (int e = -kExponents; e < kExponents; ++e)
      boxes.push_back(point_box(std::ldexp(TypeParam{1}, e), TypeParam{0}, TypeParam{0}));
  }
  expect_valid(boxes);
}

TYPED_TEST(BvhBuildTest, SpreadsThatOverflowOrUnderflowAreHalved) {
  constexpr TypeParam kLargest = std::numeric_limits<TypeParam>::max();
  constexpr TypeParam kSmallest = std::numeric_limits<TypeParam>::denorm_min();
  std::vector<Aabb<TypeParam>> boxes;
  for (int i = 0; i < 100; ++i) {
    boxes.push_back(point_box(i % 2 == 0 ? kLargest : -kLargest, kSmallest * TypeParam(i), TypeParam{0}));
  }
  expect_valid(boxes);
  for (Aabb<TypeParam>& box : boxes) box.min.x = box.max.x = 0;
  expect_valid(boxes);
}

TYPED_TEST(BvhBuildTest, OneHugeBoxAmongTinyOnesGivesAValidTree) {
  std::vector<Aabb<TypeParam>> boxes = random_boxes<TypeParam>(500, 8);
  boxes.push_back({{-1e9f, -1e9f, -1e9f}, {1e9f, 1e9f, 1e9f}});
  expect_valid(boxes);
}

TYPED_TEST(BvhBuildTest, EqualInputsGiveEqualTrees) {
  const std::vector<Aabb<TypeParam>> boxes = random_boxes<TypeParam>(5'000, 2);
  const BvhLayout<TypeParam> a = build(boxes), b = build(boxes);
  EXPECT_EQ(a.order, b.order);
  ASSERT_EQ(a.nodes.size(), b.nodes.size());
  for (size_t i = 0; i < a.nodes.size(); ++i) {
    ASSERT_EQ(a.nodes[i].child_count, b.nodes[i].child_count);
    ASSERT_EQ(a.nodes[i].bounds, b.nodes[i].bounds);
    for (uint32_t slot = 0; slot < a.nodes[i].child_count; ++slot) {
      ASSERT_EQ(a.nodes[i].children[slot].first, b.nodes[i].children[slot].first);
      ASSERT_EQ(a.nodes[i].children[slot].count, b.nodes[i].children[slot].count);
    }
  }
}

TEST(BvhBuildRefusalTest, ASetCancelFlagEndsTheBuildWithCancelled) {
  const std::atomic<bool> cancel = true;
  BvhOptions options;
  options.cancel = &cancel;
  const std::vector<Aabbf> boxes = random_boxes<float>(1'000, 5);
  EXPECT_EQ(build_bvh_layout<float>(boxes, options).status().code(), absl::StatusCode::kCancelled);
}

TEST(BvhBuildRefusalTest, BinsOutOfRangeAreRefusedWithTheFieldName) {
  for (const int bins : {-1, 0, 1, 65, 1'000'000}) {
    BvhOptions options;
    options.bins = bins;
    const absl::Status status = build_bvh_layout<float>({}, options).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << bins;
    ASSERT_TRUE(refusal_of(status).has_value());
    EXPECT_EQ(refusal_of(status)->field, "bins");
  }
}

TEST(BvhBuildRefusalTest, ABoxThatIsNotFiniteIsRefusedWithItsIndex) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  for (const Aabbf& bad : {Aabbf{}, point_box(kNan, 0.0f, 0.0f), point_box(0.0f, kInfinity, 0.0f),
                           Aabbf{{0, 0, 0}, {1, 1, kNan}}, Aabbf{{1, 0, 0}, {0, 0, 0}}}) {
    std::vector<Aabbf> boxes = random_boxes<float>(20, 6);
    boxes[13] = bad;
    const absl::Status status = build_bvh_layout<float>(boxes, {}).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    ASSERT_TRUE(refusal_of(status).has_value());
    EXPECT_EQ(refusal_of(status)->reason, Reason::kNotFinite);
    EXPECT_EQ(refusal_of(status)->index, 13u);
  }
}

}  // namespace
}  // namespace locus::test
