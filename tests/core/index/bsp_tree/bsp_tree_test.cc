#include "core/index/bsp_tree/bsp_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/index/queries/index_queries.h"
#include "tests/support/bsp_trials.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;

static_assert(MutableSpatialIndex<BspTree<Triangle>>);
static_assert(MutableSpatialIndex<BspTree<Object>>);
static_assert(Planar<Triangle> && !Planar<Object>);

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

Object box_at(Id id, Vec3d center, float half = 0.25f) {
  Object object;
  object.id = id;
  object.shape.kind = ShapeKind::kBox;
  object.shape.position = center;
  object.shape.size = {half, half, half};
  return object;
}

// Returns boxes with the ids 1 to `count` at random positions, about `spacing` apart.
std::vector<Object> uniform_boxes(size_t count, double spacing, uint64_t seed) {
  Random random(seed);
  const double side = spacing * std::cbrt(static_cast<double>(count)) / 2;
  std::vector<Object> boxes;
  for (Id id = 1; id <= count; ++id) boxes.push_back(box_at(id, random.vector(side)));
  return boxes;
}

template <class Tree>
std::vector<uint64_t> ids_in_box(const Tree& tree, Vec3d center, double half) {
  std::vector<typename Tree::Value> found;
  conservative_box(tree, {center, {half, half, half}, {}}, found);
  std::vector<uint64_t> ids;
  for (const auto& value : found) ids.push_back(Tree::Traits::id(value));
  std::sort(ids.begin(), ids.end());
  return ids;
}

template <class Tree>
void expect_equals_list(const Tree& tree, const std::vector<Object>& values, double size, uint64_t seed) {
  Random random(seed);
  const ListIndex<Object> list = make_list(values);
  const IndexJudge judge(tree, list);
  for (uint64_t i = 0; i < 20; ++i) {
    const Vec3d at = values.empty() ? random.vector(size) : random.pick(values).shape.position;
    ASSERT_EQ(judge.ray_difference(ObjectRay({at + random.vector(size), random.unit_vector()}), i), "");
    ASSERT_EQ(judge.ball_difference({at + random.vector(1), random.between(0, 2)}), "");
    ASSERT_EQ(judge.point_difference(at + random.vector(size)), "");
  }
}

// Box of doubles, so that neighbours can be one ulp apart.
struct Exact {
  uint64_t id = 0;
  Aabbd box;
};
struct ExactTraits {
  using Scalar = double;
  static uint64_t id(const Exact& value) { return value.id; }
  static Aabbd bounds(const Exact& value) { return value.box; }
  static Vec3d position(const Exact& value) { return value.box.min; }
};
using ExactTree = BspTree<Exact, ExactTraits>;

struct ExactRecorder {
  Aabbd region;
  std::vector<uint64_t> ids;

  Aabbd bounds() const { return region; }
  bool overlaps(const Aabbd& box) const { return locus::overlaps(box, region); }
  bool visit(const Exact& value) {
    ids.push_back(value.id);
    return true;
  }
};

std::vector<uint64_t> ids_in(const ExactTree& tree, const Aabbd& region) {
  ExactRecorder recorder{region, {}};
  Work work;
  tree.visit_region(recorder, work);
  return recorder.ids;
}

TEST(BspTreeTest, AnEmptyTreeAnswersNothingAndHasOneCell) {
  for (const BspTreeOptions& options : kBspTrials) {
    const BspTree<Object> tree = BspTree<Object>::build({}, options);
    EXPECT_EQ(tree.size(), 0u);
    EXPECT_EQ(tree.shape().nodes, 1u);
    EXPECT_FALSE(any_ray(tree, ObjectRay({{}, {1, 0, 0}}), kNoLimit));
    EXPECT_TRUE(ids_in_box(tree, {}, 1e9).empty());
    EXPECT_TRUE(tree.cell_of_leaf(tree.leaf_of({})).empty());
  }
}

TEST(BspTreeTest, TheLeafOfAPointListsTheValuesThere) {
  const BspTree<Object> tree = BspTree<Object>::build(uniform_boxes(200, 2, 3), {.leaf_size = 1});
  for (Id id = 1; id <= 200; ++id) {
    const Vec3d at = uniform_boxes(200, 2, 3)[id - 1].shape.position;
    std::vector<Id> listed;
    tree.for_each_in_leaf(tree.leaf_of(at), [&listed](const Object& object) { listed.push_back(object.id); });
    EXPECT_THAT(listed, ::testing::Contains(id));
  }
}

TEST(BspTreeTest, WallsOfACityDivideItByTheirPlanes) {
  const BspTree<Triangle> tree = BspTree<Triangle>::build(box_city(4, 1), {.planes = BspPlanes::kValues});
  size_t oblique = 0, cells = 0;
  for (const CellNumber leaf : leaves_from(tree, {})) {
    ++cells;
    for (const Plane& plane : tree.cell_of_leaf(leaf)) oblique += max_component(abs(plane.normal)) < 1 - 1e-12;
  }
  EXPECT_GT(cells, 20u);
  EXPECT_EQ(oblique, 0u);
}

TEST(BspTreeTest, ObliqueTrianglesOfferObliquePlanes) {
  std::vector<Triangle> triangles;
  for (int i = 0; i < 40; ++i) {
    const auto at = static_cast<float>(10 * i);
    triangles.push_back({{at, 0, 0}, {at, 1, 0}, {at + 1, 0, 1}});
  }
  number_in_order(triangles);
  const auto tree = BspTree<Triangle>::build(triangles, {.planes = BspPlanes::kValues, .leaf_size = 2});
  const std::vector<Plane> cell = tree.cell_of_leaf(tree.leaf_of({200, 0, 0}));
  EXPECT_TRUE(
      std::any_of(cell.begin(), cell.end(), [](const Plane& plane) { return max_component(abs(plane.normal)) < 0.9; }));
}

// A value in two leaves must be passed once, and be found from both sides of the plane.
TEST(BspTreeTest, AValueOnAPlaneIsFoundFromBothSidesAndOnce) {
  for (const CutValues cut : {CutValues::kInLeaves, CutValues::kAtNode}) {
    std::vector<Exact> values;
    for (uint64_t i = 0; i < 41; ++i) values.push_back({i, {{double(i), 0, 0}, {double(i), 1, 1}}});
    const ExactTree tree = ExactTree::build(values, {.cut = cut, .leaf_size = 1});
    EXPECT_EQ(ids_in(tree, {{19.5, 0, 0}, {20, 1, 1}}), (std::vector<uint64_t>{20}));
    EXPECT_EQ(ids_in(tree, {{20, 0, 0}, {20.5, 1, 1}}), (std::vector<uint64_t>{20}));
    EXPECT_THAT(ids_in(tree, {{19, 0, 0}, {21, 1, 1}}), UnorderedElementsAre(19, 20, 21));
    EXPECT_EQ(ids_in(tree, {{-9, 0, 0}, {99, 1, 1}}).size(), 41u);
  }
}

TEST(BspTreeTest, RegionsThatTouchAPlaneFindTheValuesThatTouchItFromTheOtherSide) {
  for (const CutValues cut : {CutValues::kInLeaves, CutValues::kAtNode}) {
    std::vector<Exact> values;
    for (uint64_t i = 0; i < 40; ++i) values.push_back({i, {{double(i), 0, 0}, {double(i) + 1, 1, 1}}});
    const ExactTree tree = ExactTree::build(values, {.cut = cut, .leaf_size = 1});
    for (uint64_t i = 1; i < 40; ++i) {
      const double x = static_cast<double>(i);
      EXPECT_THAT(ids_in(tree, {{x, 0, 0}, {x, 1, 1}}), UnorderedElementsAre(i - 1, i));
    }
  }
}

TEST(BspTreeTest, TwoValuesOneUlpApartAreTwoValues) {
  std::vector<Exact> values;
  const double next = std::nextafter(1.0, 2.0);
  for (uint64_t i = 0; i < 20; ++i) {
    const double x = i % 2 == 0 ? 1.0 : next;
    values.push_back({i, {{x, 0, 0}, {x, 0, 0}}});
  }
  const ExactTree tree = ExactTree::build(values, {.leaf_size = 1});
  EXPECT_EQ(ids_in(tree, {{0, 0, 0}, {1, 0, 0}}).size(), 10u);
  EXPECT_EQ(ids_in(tree, {{next, 0, 0}, {2, 0, 0}}).size(), 10u);
}

TEST(BspTreeTest, RemoveFindsAValueByItsIdInAllItsLeaves) {
  for (const BspTreeOptions& options : kBspTrials) {
    std::vector<Object> boxes = uniform_boxes(300, 1, 5);
    boxes.push_back(box_at(999, {}, 20));
    BspTree<Object> tree = BspTree<Object>::build(boxes, options);
    ASSERT_TRUE(tree.contains(box_at(999, {50, 0, 0})));
    ASSERT_TRUE(tree.remove(box_at(999, {50, 0, 0}))) << "the value is where it was inserted";
    EXPECT_FALSE(tree.remove(box_at(999, {})));
    EXPECT_FALSE(tree.contains(box_at(999, {})));
    EXPECT_EQ(ids_in_box(tree, {}, 100).size(), 300u);
    tree.insert(box_at(1000, {200, 0, 0}));  // takes the entry of the removed value
    EXPECT_EQ(ids_in_box(tree, {}, 100).size(), 300u);
    EXPECT_THAT(ids_in_box(tree, {200, 0, 0}, 1), ElementsAre(1000));
  }
}

TEST(BspTreeDeathTest, InsertOfAPresentIdIsAProgrammerError) {
  BspTree<Object> tree;
  tree.insert(box_at(7, {}));
  EXPECT_DEATH(tree.insert(box_at(7, {1, 0, 0})), "check failed");
}

TEST(BspTreeDeathTest, BoundsWithoutEndAreAProgrammerError) {
  EXPECT_DEATH(BspTree<Object>::build({box_at(1, {kNoLimit, 0, 0})}), "check failed");
}

TEST(BspTreeTest, HubAndCountryAreFoundAlike) {
  Random random(8);
  std::vector<Object> boxes;
  for (Id id = 1; id <= 2'000; ++id)
    boxes.push_back(box_at(id, id % 10 == 0 ? random.vector(1e5) : random.vector(3), id % 10 == 0 ? 10 : 0.01f));
  for (const BspTreeOptions& options : kBspTrials) {
    const BspTree<Object> tree = BspTree<Object>::build(boxes, options);
    EXPECT_EQ(excess(tree.shape(), tree.size(), options), "");
    expect_equals_list(tree, boxes, 5, 9);
  }
}

TEST(BspTreeTest, ManyEqualValuesShareALeaf) {
  const std::vector<Object> boxes = [] {
    std::vector<Object> equal;
    for (Id id = 1; id <= 100'000; ++id) equal.push_back(box_at(id, {1, 2, 3}));
    return equal;
  }();
  BspTree<Object> tree = BspTree<Object>::build(boxes);
  EXPECT_EQ(tree.shape().nodes, 1u);
  EXPECT_EQ(ids_in_box(tree, {1, 2, 3}, 0.1).size(), boxes.size());
  BspTree<Object> grown;
  for (const Object& box : boxes) grown.insert(box);
  EXPECT_EQ(grown.shape().nodes, 1u);
  for (Id id = 1; id <= 1'000; ++id) ASSERT_TRUE(grown.remove(boxes[id - 1]));
  EXPECT_EQ(ids_in_box(grown, {1, 2, 3}, 0.1).size(), boxes.size() - 1'000);
}

TEST(BspTreeTest, ValuesFarOutsideOfTheFirstBoundsAreFound) {
  for (const BspTreeOptions& options : kBspTrials) {
    std::vector<Object> boxes = uniform_boxes(200, 2, 5);
    BspTree<Object> tree = BspTree<Object>::build(boxes, options);
    for (Id id = 1001; id <= 1100; ++id) {
      boxes.push_back(box_at(id, {1e6 + 10 * static_cast<double>(id), -1e8, 3}));
      tree.insert(boxes.back());
    }
    expect_equals_list(tree, boxes, 30, 6);
  }
}

TEST(BspTreeTest, ATreeGrownInOrderIsNotDeep) {
  BspTree<Object> tree;
  for (Id id = 1; id <= 20'000; ++id) tree.insert(box_at(id, {static_cast<double>(id), 0, 0}));
  Work work;
  std::vector<Object> found;
  conservative_ball(tree, {{19'000, 0, 0}, 0.5}, found, &work);
  EXPECT_EQ(found.size(), 1u);
  EXPECT_LT(work.nodes, 100u);
  EXPECT_LT(tree.shape().nodes, 2 * tree.size());
  EXPECT_LT(tree.shape().references, 4 * tree.size());
}

TEST(BspTreeTest, LargeValuesInsertedAmongSmallOnesDoNotFillTheTree) {
  std::vector<Object> boxes = uniform_boxes(2'000, 1, 5);
  BspTree<Object> tree = BspTree<Object>::build(boxes);
  for (Id id = 10'001; id <= 10'300; ++id) {
    boxes.push_back(box_at(id, {}, 100));
    tree.insert(boxes.back());
  }
  EXPECT_LT(tree.shape().references, 20 * tree.size());
  expect_equals_list(tree, boxes, 10, 4);
}

TEST(BspTreeTest, EqualsTheListThroughRandomInsertsAndRemoves) {
  for (const BspTreeOptions& options : kBspTrials) {
    Random random(17);
    BspTree<Object> tree(options);
    std::vector<Object> present;
    Id next = 1;
    for (uint64_t step = 0; step < scaled_count(10'000); ++step) {
      const double drift = static_cast<double>(step) * 0.01;
      if (present.size() < 200 || (random.chance(0.5) && present.size() < 400)) {
        const float half = random.chance(0.1) ? 5 : 0.2f;
        present.push_back(box_at(next++, random.vector(8) + Vec3d{drift, 0, 0}, half));
        tree.insert(present.back());
      } else {
        const size_t at = random.below(present.size());
        ASSERT_TRUE(tree.remove(present[at]));
        present[at] = present.back();
        present.pop_back();
      }
      if (step % 2'000 == 1'999) expect_equals_list(tree, present, 10, step);
    }
    ASSERT_EQ(tree.size(), present.size());
    EXPECT_LT(tree.shape().nodes, 4 * tree.size() + 64) << "empty leaves are joined";
    for (const Object& object : present) ASSERT_TRUE(tree.remove(object));
    EXPECT_EQ(tree.shape().references, 0u);
    EXPECT_LE(tree.shape().nodes, 64u);
  }
}

TEST(BspTreeTest, ANumberDenotesTheSameCellThroughChanges) {
  std::vector<Object> boxes = uniform_boxes(500, 2, 5);
  BspTree<Object> tree = BspTree<Object>::build(boxes);
  std::map<CellNumber, std::vector<Plane>> cells;
  for (const CellNumber leaf : leaves_from(tree, {})) {
    EXPECT_LT(leaf, tree.shape().nodes);
    cells[leaf] = tree.cell_of_leaf(leaf);
  }
  Random random(3);
  for (Id id = 1; id <= 400; ++id) tree.remove(boxes[id - 1]);
  for (Id id = 1001; id <= 1300; ++id) tree.insert(box_at(id, random.vector(6)));
  size_t kept = 0;
  for (const auto& [number, planes] : cells) {
    if (!tree.has_cell(number)) continue;
    ++kept;
    const std::vector<Plane> now = tree.cell_of_leaf(number);
    ASSERT_EQ(now.size(), planes.size());
    for (size_t i = 0; i < planes.size(); ++i) {
      EXPECT_EQ(now[i].normal, planes[i].normal);
      EXPECT_EQ(now[i].offset, planes[i].offset);
    }
  }
  EXPECT_GT(kept, 0u);
  EXPECT_LT(kept, cells.size()) << "some cells were joined";
}

TEST(BspTreeTest, RaysPassLeavesNearToFar) {
  std::vector<Object> boxes;
  for (Id id = 1; id <= 64; ++id) boxes.push_back(box_at(id, {10.0 * static_cast<double>(id), 0, 0}));
  const BspTree<Object> tree = BspTree<Object>::build(boxes, {.leaf_size = 1});
  Object hit;
  double t = kNoLimit;
  Work work;
  ASSERT_TRUE(first_ray(tree, ObjectRay({{}, {1, 0, 0}}), hit, t, &work));
  EXPECT_EQ(hit.id, 1u);
  EXPECT_EQ(work.tests, 1u);
  EXPECT_LT(work.nodes, 12u);
}

// Measures work instead of time. In leaves, the work of a small query hardly grows with the number of values; at nodes
// it grows by a power, because large nodes keep the values that their planes cut.
TEST(BspTreeTest, TheWorkOfSmallQueriesHardlyGrowsInLeaves) {
  const auto work_of = [](size_t count, CutValues cut) {
    const std::vector<Object> boxes = uniform_boxes(count, 1, 7);
    const BspTree<Object> tree = BspTree<Object>::build(boxes, {.cut = cut});
    Work work;
    Random random(1);
    for (int i = 0; i < 500; ++i) {
      std::vector<Object> found;
      conservative_ball(tree, {random.pick(boxes).shape.position, 0.5}, found, &work);
    }
    return static_cast<double>(work.nodes + work.cells + work.tests);
  };
  const auto exponent = [&work_of](CutValues cut) {
    return std::log(work_of(64'000, cut) / work_of(1'000, cut)) / std::log(64);
  };
  EXPECT_LE(exponent(CutValues::kInLeaves), 0.20);
  EXPECT_GT(exponent(CutValues::kAtNode), 0.4);
}

}  // namespace
}  // namespace locus::test
