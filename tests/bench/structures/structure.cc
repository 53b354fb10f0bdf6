#include "tests/bench/structures/structure.h"

#include <bit>
#include <optional>
#include <utility>

#include "core/base/check.h"
#include "core/index/bsp_tree/bsp_tree.h"
#include "core/index/bvh/bvh.h"
#include "core/index/grid/grid.h"
#include "core/index/kd_tree/kd_tree.h"
#include "core/index/list/list_index.h"
#include "core/index/octree/octree.h"
#include "core/index/queries/nearest_values.h"
#include "core/index/sphere_tree/sphere_tree.h"
#include "tests/support/object_grid.h"

namespace locus::bench::structures {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Returns a hash of an id and a distance.
uint64_t mixed(uint64_t id, double distance) {
  uint64_t bits = (id * 0x9E3779B97F4A7C15u) ^ std::bit_cast<uint64_t>(distance);
  bits = (bits ^ (bits >> 32)) * 0xD6E8FEB86659FD93u;
  return bits ^ (bits >> 32);
}

template <class Index>
uint64_t hash_of_first(const Index& index, const ObjectRay& ray, double distance, Work& work) {
  Object found;
  return first_ray(index, ray, found, distance, &work) ? mixed(found.id, distance) : 1;
}

uint64_t hash_of_all(const std::vector<Object>& found) {
  uint64_t sum = found.size();
  for (const Object& box : found) sum += mixed(box.id, 0);
  return sum;
}

template <class Index>
uint64_t answer_of(const Index& index, QueryName query, const SceneQueries& queries, size_t number, Work& work) {
  std::vector<Object> found;
  switch (query) {
    case QueryName::kRay:
      return hash_of_first(index, queries.rays[number], kInfinity, work);
    case QueryName::kRayShort:
      return hash_of_first(index, queries.rays[number], queries.short_length, work);
    case QueryName::kAny:
      return any_ray(index, queries.rays[number], kInfinity, &work) ? 2 : 1;
    case QueryName::kBall:
      ball_overlap(index, queries.balls[number], found, &work);
      return hash_of_all(found);
    case QueryName::kBox:
      box_overlap(index, queries.boxes[number], found, &work);
      return hash_of_all(found);
    case QueryName::kNearest:
      break;
  }
  std::vector<ValueAt<Object>> nearest;
  nearest_values(index, queries.points[number], kInfinity, kNearestCount, nearest, &work);
  uint64_t sum = 0;
  for (const ValueAt<Object>& at : nearest) sum += mixed(at.value.id, at.distance);
  return sum;
}

// Contestant that holds an Index, which Make makes of the boxes.
template <class Index, Index (*make)(const std::vector<Object>&)>
class StructureOf final : public Structure {
 public:
  void build(const std::vector<Object>& boxes) override {
    index_.reset();
    index_.emplace(make(boxes));
  }
  bool changes() const override { return MutableSpatialIndex<Index>; }
  void insert(const Object& box) override {
    if constexpr (MutableSpatialIndex<Index>) index_->insert(box);
  }
  void remove(const Object& box) override {
    if constexpr (MutableSpatialIndex<Index>) index_->remove(box);
  }
  uint64_t answer(QueryName query, const SceneQueries& queries, size_t number, Work& work) const override {
    return answer_of(*index_, query, queries, number, work);
  }

 private:
  std::optional<Index> index_;
};

ListIndex<Object> make_list(const std::vector<Object>& boxes) {
  ListIndex<Object> list;
  for (const Object& box : boxes) list.insert(box);
  return list;
}

// For trees whose build can fail.
template <class Tree>
Tree make_tree(const std::vector<Object>& boxes) {
  absl::StatusOr<Tree> tree = Tree::build(boxes);
  LOCUS_CHECK(tree.ok());
  return *std::move(tree);
}

template <class Index>
Index make_index(const std::vector<Object>& boxes) {
  return Index::build(boxes);
}

template <class Index, class IndexOptions>
Index make_at_node(const std::vector<Object>& boxes) {
  IndexOptions options;
  options.cut = CutValues::kAtNode;
  return Index::build(boxes, options);
}

test::ObjectGrid make_hash_grid(const std::vector<Object>& boxes) {
  test::ObjectGrid grid;
  grid.apply({}, boxes);
  return grid;
}

template <GridOrder order>
Grid<Object> make_grid(const std::vector<Object>& boxes) {
  GridOptions options;
  options.order = order;
  return Grid<Object>::build(boxes, options);
}

template <class Index, Index (*make)(const std::vector<Object>&)>
NamedStructure named(const char* name) {
  return {name, [] { return std::make_unique<StructureOf<Index, make>>(); }};
}

}  // namespace

const char* name_of(QueryName query) {
  switch (query) {
    case QueryName::kRay:
      return "ray";
    case QueryName::kRayShort:
      return "ray_short";
    case QueryName::kAny:
      return "any";
    case QueryName::kBall:
      return "ball";
    case QueryName::kBox:
      return "box";
    case QueryName::kNearest:
      break;
  }
  return "nearest";
}

std::vector<NamedStructure> structures() {
  using Kd = KdTree<Object>;
  using Oct = Octree<Object>;
  using Bsp = BspTree<Object>;
  return {named<ListIndex<Object>, make_list>("list"),
          named<Bvh<Object>, make_tree<Bvh<Object>>>("bvh"),
          named<test::ObjectGrid, make_hash_grid>("hash_grid"),
          named<Grid<Object>, make_grid<GridOrder::kXMajor>>("grid"),
          named<Grid<Object>, make_grid<GridOrder::kMorton>>("grid_morton"),
          named<Kd, make_index<Kd>>("kd_tree"),
          named<Kd, make_at_node<Kd, KdTreeOptions>>("kd_tree_at_node"),
          named<Oct, make_index<Oct>>("octree"),
          named<Oct, make_at_node<Oct, OctreeOptions>>("octree_at_node"),
          named<Bsp, make_index<Bsp>>("bsp_tree"),
          named<SphereTree<Object>, make_tree<SphereTree<Object>>>("sphere_tree")};
}

}  // namespace locus::bench::structures
