// The spatial structures that must answer as the list does, each as a type with a function that makes an index. Suites
// that are typed over these types test every structure alike. To add a structure, write its type and list it in
// StructuresOf.
#ifndef LOCUS_TESTS_SUPPORT_INDEX_STRUCTURES_H_
#define LOCUS_TESTS_SUPPORT_INDEX_STRUCTURES_H_

#include <gtest/gtest.h>

#include <type_traits>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/index/bsp_tree/bsp_tree.h"
#include "core/index/bvh/bvh.h"
#include "core/index/grid/grid.h"
#include "core/index/kd_tree/kd_tree.h"
#include "core/index/list/list_index.h"
#include "core/index/octree/octree.h"
#include "core/index/sphere_tree/sphere_tree.h"
#include "tests/support/object_grid.h"

namespace locus::test {

// Each structure has: Index, the type of its indexes; make(values), which builds an index. If Index has insert() and
// remove(), they are tested too. If it has shape(), its limits are tested.
template <class V>
struct ListStructure {
  using Index = ListIndex<V>;
  static Index make(const std::vector<V>& values) {
    Index index;
    for (const V& value : values) index.insert(value);
    return index;
  }
};

template <class V>
struct BvhStructure {
  using Index = Bvh<V>;
  static Index make(const std::vector<V>& values) {
    absl::StatusOr<Index> tree = Index::build(values);
    LOCUS_CHECK(tree.ok());
    return *std::move(tree);
  }
};

struct GridStructure {
  using Index = ObjectGrid;
  static Index make(const std::vector<Object>& values) {
    Index grid;
    grid.apply({}, values);
    return grid;
  }
};

template <class V, KdAxis axis, KdSplit split, CutValues cut>
struct KdTreeStructure {
  using Index = KdTree<V>;
  static Index make(const std::vector<V>& values) {
    KdTreeOptions options;
    options.axis = axis;
    options.split = split;
    options.cut = cut;
    options.leaf_size = 2;  // the scenes of tests are small
    return Index::build(values, options);
  }
};

// `axes` has bit 0 for x, bit 1 for y and bit 2 for z.
template <class V, int axes, CutValues cut>
struct OctreeStructure {
  using Index = Octree<V>;
  static Index make(const std::vector<V>& values) {
    OctreeOptions options;
    options.axes = {.x = (axes & 1) != 0, .y = (axes & 2) != 0, .z = (axes & 4) != 0};
    options.cut = cut;
    options.leaf_size = 2;
    return Index::build(values, options);
  }
};

template <class V, BspPlanes planes, CutValues cut>
struct BspTreeStructure {
  using Index = BspTree<V>;
  static Index make(const std::vector<V>& values) {
    BspTreeOptions options;
    options.planes = planes;
    options.cut = cut;
    options.leaf_size = 2;
    return Index::build(values, options);
  }
};

template <class V, GridOrder order, class Cell = GridList<V, PrimitiveTraits<V>>>
struct FiniteGridStructure {
  using Index = Grid<V, PrimitiveTraits<V>, Cell>;
  static Index make(const std::vector<V>& values) {
    GridOptions options;
    options.order = order;
    return Index::build(values, options);
  }
};

template <class V>
struct SphereTreeStructure {
  using Index = SphereTree<V>;
  static Index make(const std::vector<V>& values) {
    absl::StatusOr<Index> tree = Index::build(values);
    LOCUS_CHECK(tree.ok());
    return *std::move(tree);
  }
};

template <class V, KdSplit split>
using KdTreeInLeaves = KdTreeStructure<V, KdAxis::kWidest, split, CutValues::kInLeaves>;
template <class V, KdSplit split>
using KdTreeAtNode = KdTreeStructure<V, KdAxis::kWidest, split, CutValues::kAtNode>;
template <class V, KdSplit split>
using KdTreeByTurns = KdTreeStructure<V, KdAxis::kByTurns, split, CutValues::kInLeaves>;

// List of structures.
template <class... Structures>
struct StructureList {};

namespace internal {
template <class... Lists>
struct Join;
template <class... A>
struct Join<StructureList<A...>> {
  using List = StructureList<A...>;
  using GoogleTypes = ::testing::Types<A...>;
};
template <class... A, class... B, class... Others>
struct Join<StructureList<A...>, StructureList<B...>, Others...> : Join<StructureList<A..., B...>, Others...> {};

template <class List>
struct Mutable;
template <class... A>
struct Mutable<StructureList<A...>> {
  using List = typename Join<
      std::conditional_t<MutableSpatialIndex<typename A::Index>, StructureList<A>, StructureList<>>...>::List;
};
}  // namespace internal

// All elements of several lists.
template <class... Lists>
using Joined = typename internal::Join<Lists...>::List;
// The elements of a list that have insert() and remove().
template <class List>
using MutableOf = typename internal::Mutable<List>::List;
// The list as TYPED_TEST_SUITE takes it.
template <class List>
using TypesOf = typename internal::Join<List>::GoogleTypes;

template <class V>
using KdTreesInLeavesOf = StructureList<KdTreeInLeaves<V, KdSplit::kMiddle>, KdTreeInLeaves<V, KdSplit::kMean>,
                                        KdTreeInLeaves<V, KdSplit::kMedian>, KdTreeInLeaves<V, KdSplit::kSah>,
                                        KdTreeByTurns<V, KdSplit::kMiddle>, KdTreeByTurns<V, KdSplit::kMean>,
                                        KdTreeByTurns<V, KdSplit::kMedian>, KdTreeByTurns<V, KdSplit::kSah>>;
template <class V>
using KdTreesAtNodeOf = StructureList<KdTreeAtNode<V, KdSplit::kMiddle>, KdTreeAtNode<V, KdSplit::kMean>,
                                      KdTreeAtNode<V, KdSplit::kMedian>, KdTreeAtNode<V, KdSplit::kSah>>;

template <class V>
using OctreesOf = StructureList<OctreeStructure<V, 7, CutValues::kInLeaves>, OctreeStructure<V, 7, CutValues::kAtNode>,
                                OctreeStructure<V, 3, CutValues::kInLeaves>, OctreeStructure<V, 4, CutValues::kAtNode>>;
template <class V>
using BspTreesOf = StructureList<BspTreeStructure<V, BspPlanes::kBest, CutValues::kInLeaves>,
                                 BspTreeStructure<V, BspPlanes::kBest, CutValues::kAtNode>>;
template <class V>
using FiniteGridsOf =
    StructureList<FiniteGridStructure<V, GridOrder::kXMajor>, FiniteGridStructure<V, GridOrder::kMorton>,
                  FiniteGridStructure<V, GridOrder::kXMajor, BspTree<V>>>;

// Structures of values of type V. One line for each family.
template <class V>
using StructuresOf = Joined<StructureList<ListStructure<V>>,  //
                            StructureList<BvhStructure<V>>,   //
                            KdTreesInLeavesOf<V>,             //
                            KdTreesAtNodeOf<V>,               //
                            OctreesOf<V>,                     //
                            BspTreesOf<V>,                    //
                            FiniteGridsOf<V>,                 //
                            StructureList<SphereTreeStructure<V>>>;

using ObjectStructures = Joined<StructuresOf<Object>, StructureList<GridStructure>>;
using AllStructures = Joined<StructuresOf<Triangle>, ObjectStructures>;

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_INDEX_STRUCTURES_H_
