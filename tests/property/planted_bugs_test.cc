// Proves that the suite catches known bugs (mutation testing). Each planted bug is enabled in turn, in a library that
// is built with the bugs. With the bug, the comparison in the bug's row must find a difference. Without the bug, the
// same comparison must find no difference. A new bug needs a name in core/base/planted_bug.h, code that checks
// planted(), and a row in the table of this file.
#include <gtest/gtest.h>

#include "core/base/planted_bug.h"
#include "core/index/bvh/kernels/crossing_kernels.h"
#include "core/index/bvh/kernels/nearest_kernels.h"
#include "core/index/bvh/kernels/ray_kernels.h"
#include "core/index/bvh/kernels/region_kernels.h"
#include "tests/support/bsp_trials.h"
#include "tests/support/conservative_answers.h"
#include "tests/support/crossing_trials.h"
#include "tests/support/door_lockstep.h"
#include "tests/support/edge_on_cases.h"
#include "tests/support/finite_grid_comparison.h"
#include "tests/support/grid_comparison.h"
#include "tests/support/kernel_trials.h"
#include "tests/support/kind_trials.h"
#include "tests/support/nearest_trials.h"
#include "tests/support/octree_comparison.h"
#include "tests/support/part_scenes.h"
#include "tests/support/placed_scenes.h"
#include "tests/support/point_comparison.h"
#include "tests/support/region_trials.h"
#include "tests/support/rewind_lockstep.h"
#include "tests/support/scene_lockstep.h"
#include "tests/support/scene_search.h"
#include "tests/support/sphere_tree_trials.h"
#include "tests/support/structure_comparison.h"
#include "tests/support/sweep_trials.h"

namespace locus::test {
namespace {

// Function that returns the first difference; an empty string if there is none.
using Comparison = std::string (*)();

std::string compare_trees_with_list() { return search_all_scenes<Triangle>(200, 200, tree_difference<Triangle>); }

std::string compare_triangle_trees_with_list() {
  return search_all_scenes<Triangle>(200, 200, triangle_tree_difference);
}

std::string compare_bsp_trees_with_list() {
  std::string what = search_all_scenes<Triangle>(50, 100, bsp_difference<Triangle>);
  return what.empty() ? search_all_scenes<Object>(50, 100, bsp_difference<Object>) : what;
}

std::string compare_changed_bsp_trees_with_list() {
  return search_all_scenes<Object>(50, 100, changed_bsp_difference<Object>);
}

std::string compare_sphere_trees_with_list() {
  std::string what = search_all_scenes<Triangle>(200, 200, sphere_tree_difference<Triangle>);
  return what.empty() ? search_all_scenes<Object>(200, 200, sphere_tree_difference<Object>) : what;
}

std::string compare_grids_with_list() {
  return search_grid_scenes(scaled_count(400), any_adversarial_scene, grid_difference);
}

std::string compare_balls_of_grids_with_list() {
  return search_grid_scenes(scaled_count(400), any_adversarial_scene, grid_ball_difference);
}

std::string compare_kd_trees_with_list() {
  using KdTrees = StructureList<KdTreeInLeaves<Object, KdSplit::kMiddle>, KdTreeInLeaves<Triangle, KdSplit::kSah>,
                                KdTreeByTurns<Triangle, KdSplit::kMedian>>;
  return search_structures(KdTrees(), 60, 180);
}

std::string compare_points_with_all() { return points_difference<double, 2>(scaled_count(50)); }

std::string compare_moving_grids_with_list() {
  return search_grid_scenes(scaled_count(40), any_adversarial_scene, moving_grid_difference);
}

std::string compare_octrees_with_list() { return search_octrees(scaled_count(20), scaled_count(60)); }

std::string compare_finite_grids_with_list() { return search_all_finite_grids(scaled_count(20), scaled_count(60)); }

std::string compare_scenes_with_model() { return search_scene_lockstep(scaled_count(20), 60); }

std::string compare_compounds_with_parts() { return search_part_scenes(scaled_count(300)); }

std::string compare_doors_with_model() { return search_door_lockstep(scaled_count(10), 30); }

std::string compare_rewinds_with_model() { return search_rewind_lockstep(scaled_count(10), 40); }

std::string compare_rewinds_of_busy_ticks_with_model() {
  return search_rewind_lockstep(scaled_count(10), 40, kTicksOfManyBatches);
}

std::string search_placed_scenes(QueryScene (*draw)(Random&), std::string (*fault)(const QueryScene&)) {
  for (uint64_t seed = 0; seed < scaled_count(400); ++seed) {
    Random random(seed);
    if (std::string what = fault(draw(random)); !what.empty()) return what;
  }
  return "";
}

std::string compare_conservative_answers_with_bounds() { return search_placed_scenes(far_scene, placed_bounds_fault); }

std::string compare_conservative_overlaps_with_exact() { return search_placed_scenes(touching_scene, superset_fault); }

std::string compare_grazing_sweeps() { return grazing_difference(scaled_count(10'000)); }

const std::vector<CrossingTrial>& crossing_trials() {
  static const std::vector<CrossingTrial>* const kTrials = new std::vector<CrossingTrial>(all_crossing_trials());
  return *kTrials;
}

std::string compare_half_lines_with_list() {
  for (const CrossingTrial& trial : crossing_trials())
    if (std::string what = trial.difference(); !what.empty()) return what;
  return "";
}

std::string compare_winding_cells_with_list() {
  static const std::vector<CrossingTrial>* const kClosed = new std::vector<CrossingTrial>(closed_crossing_trials());
  for (const CrossingTrial& trial : *kClosed)
    if (std::string what = trial.difference_with_cells(nullptr); !what.empty()) return what;
  return "";
}

#ifdef LOCUS_X86_KERNELS
// Tests only one instruction set, because the kernels of all instruction sets are compiled from one source.
std::string compare_kernels_with_list() {
  static const std::vector<KernelTrial>* const kTrials = new std::vector<KernelTrial>(all_kernel_trials());
  for (const KernelTrial& trial : *kTrials)
    if (const std::string what = trial.difference(ray_kernels_avx2()); !what.empty()) return what;
  return "";
}

std::string compare_region_kernels_with_list() {
  static const std::vector<RegionTrial>* const kTrials = new std::vector<RegionTrial>(all_region_trials());
  for (const RegionTrial& trial : *kTrials)
    if (const std::string what = trial.difference(region_kernels_avx2()); !what.empty()) return what;
  return "";
}

std::string compare_nearest_kernels_with_list() {
  static const std::vector<NearestTrial>* const kTrials = new std::vector<NearestTrial>(all_nearest_trials());
  for (const NearestTrial& trial : *kTrials)
    if (const std::string what = trial.difference(nearest_kernels_avx2()); !what.empty()) return what;
  return "";
}

std::string compare_crossing_kernels_with_list() {
  for (const CrossingTrial& trial : crossing_trials())
    if (std::string what = trial.difference(crossing_kernels_avx2()); !what.empty()) return what;
  return "";
}
#endif

struct Trial {
  const char* name;
  PlantedBug bug;
  Comparison comparison;
};

constexpr Trial kTrials[] = {
    {"TreeWithUnpaddedNear", PlantedBug::kUnpaddedNear, compare_trees_with_list},
    {"TreeWithStrictTie", PlantedBug::kStrictTie, compare_trees_with_list},
    {"TrianglesEdgeOnDecidedInDouble", PlantedBug::kEdgeOnInDouble, edge_on_difference},
    {"TreeThatLeavesOutWhatIsAsFar", PlantedBug::kNearestLimit, compare_trees_with_list},
    {"TreeWithUnpaddedDistances", PlantedBug::kNearestTreePad, compare_triangle_trees_with_list},
    {"BspTreeWhoseRaysHaveNoPad", PlantedBug::kPaddedRayThin, compare_bsp_trees_with_list},
    {"BspTreeThatPassesValuesOfSeveralLeavesTwice", PlantedBug::kBspPassedTwice, compare_bsp_trees_with_list},
    {"BspTreeWithOneSideForWhatIsOnAPlane", PlantedBug::kBspOnPlane, compare_bsp_trees_with_list},
    {"BspTreeThatRemovesAValueFromOneLeaf", PlantedBug::kBspRemoveOnce, compare_changed_bsp_trees_with_list},
    {"BspTreeThatIgnoresTheSideOfTheEye", PlantedBug::kBspEyeBehind, bsp_order_difference},
    {"SphereTreeWhoseRaysHaveNoPad", PlantedBug::kPaddedRayThin, compare_sphere_trees_with_list},
    {"SphereTreeThatContainsOnlyCentres", PlantedBug::kSphereCenters, compare_sphere_trees_with_list},
    {"GridThatDropsACell", PlantedBug::kDropCell, compare_grids_with_list},
    {"GridWithForgottenSparseBricks", PlantedBug::kSparseBrickBounds, compare_moving_grids_with_list},
    {"GridThatTrustsFloatWithBalls", PlantedBug::kGridBallMargin, compare_balls_of_grids_with_list},
    {"GridThatTrustsFloatWithPositions", PlantedBug::kGridInsideMargin, compare_balls_of_grids_with_list},
    {"GridWithTruncatedCellIndices", PlantedBug::kUnsignedCellIndex, compare_grids_with_list},
    {"GridWithAGhostAfterAMove", PlantedBug::kGhostAfterMove, compare_moving_grids_with_list},
    {"OctreeThatForgetsValuesOnItsPlanes", PlantedBug::kOctreeLowerStrict, compare_octrees_with_list},
    {"OctreeThatPassesCutValuesTwice", PlantedBug::kPlaneTreePassedTwice, compare_octrees_with_list},
    {"OctreeThatRemovesFromOneLeaf", PlantedBug::kPlaneTreeReferenceLeft, compare_octrees_with_list},
    {"OctreeWithTheBoundsOfItsBuild", PlantedBug::kPlaneTreeFixedBounds, compare_octrees_with_list},
    {"OctreeThatRaysFromOutsideMiss", PlantedBug::kOctreeRayFromInside, compare_octrees_with_list},
    {"OctreeWithUnpaddedPlanes", PlantedBug::kOctreeRayUnpadded, compare_octrees_with_list},
    {"OctreeThatFollowsShortRaysToTheBorder", PlantedBug::kOctreeRayToBorder, octree_short_ray_fault},
    {"OctreeThatLeavesOutWhatIsAsFar", PlantedBug::kOctreeNearestStrict, compare_octrees_with_list},
    {"CellsCountedFromZero", PlantedBug::kGridForgetsMinimum, compare_finite_grids_with_list},
    {"CellsOfRaysWithTheWrongAxis", PlantedBug::kGridWrongAxis, compare_finite_grids_with_list},
    {"CellsInTheOrderOfPositiveDirections", PlantedBug::kGridSignedDirection, compare_finite_grids_with_list},
    {"CellsThatClipTheTestsOfTheirValues", PlantedBug::kGridClippedToCell, compare_finite_grids_with_list},
    {"CellsAtAccumulatedDistances", PlantedBug::kGridAccumulatedT, long_row_difference},
    {"CellsOnlyTouchedAreSkipped", PlantedBug::kGridDiagonalStep, compare_finite_grids_with_list},
    {"CellsOfShortRaysUpToTheBorder", PlantedBug::kGridRayToBorder, grid_short_ray_fault},
    {"CellsThatRaysFromOutsideMiss", PlantedBug::kGridRayFromInside, compare_finite_grids_with_list},
    {"CellsThatPassAValueTwice", PlantedBug::kGridPassedTwice, compare_finite_grids_with_list},
    {"CellsThatKeepARemovedValue", PlantedBug::kGridReferenceLeft, compare_finite_grids_with_list},
    {"CellsWithValuesFromOutside", PlantedBug::kGridClampedOutside, compare_finite_grids_with_list},
    {"CellsThatLeaveOutWhatIsAsFar", PlantedBug::kGridNearestStrict, compare_finite_grids_with_list},
    {"SceneWithAStaleSnapshot", PlantedBug::kStaleSnapshot, compare_scenes_with_model},
    {"SceneWithAGhostAfterAMove", PlantedBug::kGhostAfterMove, compare_scenes_with_model},
    {"SceneThatShowsHalfOfSeveralMessages", PlantedBug::kHalfGroup, compare_scenes_with_model},
    {"SceneWhoseObjectsExpireLate", PlantedBug::kExpiryLate, compare_scenes_with_model},
    {"SceneWhoseMovesExpireNothing", PlantedBug::kExpiryUnmoved, compare_rewinds_with_model},
    {"SceneWhoseLeasesKeepObjectsOfOthers", PlantedBug::kLeaseOfFirst, compare_scenes_with_model},
    {"SceneWhoseInstancesMoveWithoutTheirBounds", PlantedBug::kStalePlacedBounds, compare_scenes_with_model},
    {"PastWithTheInstancesOfThePresent", PlantedBug::kPastInstances, compare_doors_with_model},
    {"RewindThatLooksOnlyWhereObjectsWere", PlantedBug::kRewindReach, compare_rewinds_with_model},
    {"RewindThatForgetsTheWayBack", PlantedBug::kRewindFastBox, compare_rewinds_of_busy_ticks_with_model},
    {"PlacedBoundsAsWideAsFloatRounds", PlantedBug::kWidePlacedBounds, compare_conservative_answers_with_bounds},
    {"PlacedBoundsAlone", PlantedBug::kPlacedBoundsAlone, compare_conservative_overlaps_with_exact},
    {"CapsuleWithoutCaps", PlantedBug::kCapsuleCap, sweep_difference},
    {"CapsuleWithoutEnds", PlantedBug::kEndlessCapsule, sweep_difference},
    {"SweepThatIgnoresItsStart", PlantedBug::kSweepStart, sweep_difference},
    {"SweepOfACentreWithoutRadius", PlantedBug::kSweepLineRadius, sweep_difference},
    {"SweepOfACentreWithoutItsSegment", PlantedBug::kSweepLineAxis, sweep_difference},
    {"SweepThatTrustsDoubleBesideItsPath", PlantedBug::kSweepLineEpsilon, compare_grazing_sweeps},
    {"SweepThatPassesTooMuch", PlantedBug::kSweepPassed, sweep_difference},
    {"CrossingsWithBothEndsOfAnEdge", PlantedBug::kClosedEdge, contains_difference},
    {"CrossingsDecidedInDouble", PlantedBug::kCrossingInDouble, crossing_difference},
    {"CrossingsOfAHalfLineInTheMirror", PlantedBug::kCrossingMirror, contains_difference},
    {"CellsWithoutTheGreatestCoordinates", PlantedBug::kCellAtMax, compare_winding_cells_with_list},
    {"CellsWithWaysThatEndTooEarly", PlantedBug::kWayShort, compare_winding_cells_with_list},
    {"HalfLineWithoutItsStart", PlantedBug::kHalfLineStart, compare_half_lines_with_list},
    {"ViewWithAWrongRowOfItsMatrix", PlantedBug::kMatrixRow, view_difference},
    {"FrustumThatTrustsTheCentreOfABrick", PlantedBug::kRegionBrickReach, frustum_difference},
    {"PairsFromBothSides", PlantedBug::kPairBothSides, pair_difference},
    {"PairsCulledWithoutExtent", PlantedBug::kPairCullExtent, pair_difference},
    {"CellWithPlanesBeyondOthers", PlantedBug::kCellBeyond, cell_difference},
    {"SightThatTheOwnGroupBlocks", PlantedBug::kOwnGroupBlocks, sight_difference},
    {"FilterOfRaysForObjectsOnly", PlantedBug::kFilterRayMeshes, filter_difference},
    {"FilterByTheFirstOfSeveralGroups", PlantedBug::kFilterFirstGroup, filter_difference},
    {"FilterByAllBitsOfATag", PlantedBug::kFilterTagMask, filter_difference},
    {"FilterThatForgetsGroupsTagsAndIds", PlantedBug::kFilterLabels, filter_difference},
    {"CompoundsWhosePartsHaveNoLayers", PlantedBug::kPartMask, compare_compounds_with_parts},
    {"KdTreeWithStrictTie", PlantedBug::kStrictTie, compare_kd_trees_with_list},
    {"KdTreeThatFindsAValueOnAPlaneFromOneSide", PlantedBug::kKdLowerStrict, compare_kd_trees_with_list},
    {"KdTreeWhoseNodesForgetTheirAxis", PlantedBug::kKdAxisByTurns, compare_kd_trees_with_list},
    {"KdTreeThatPassesAValueTwice", PlantedBug::kPlaneTreePassedTwice, compare_kd_trees_with_list},
    {"KdTreeThatKeepsAReferenceToARemovedValue", PlantedBug::kPlaneTreeReferenceLeft, compare_kd_trees_with_list},
    {"KdTreeThatLosesValuesOutsideItsFirstBounds", PlantedBug::kPlaneTreeFixedBounds, compare_kd_trees_with_list},
    {"KdTreeMissedByRaysFromOutside", PlantedBug::kKdRayFromInside, compare_kd_trees_with_list},
    {"KdTreeWithUnpaddedRegions", PlantedBug::kKdRayUnpadded, compare_kd_trees_with_list},
    {"KdTreeWhoseRaysWalkToTheBorder", PlantedBug::kKdRayToBorder, short_ray_fault},
    {"KdTreeThatLosesWhatIsAsFarAsTheLimit", PlantedBug::kKdNearestStrict, compare_kd_trees_with_list},
    {"PointsThatLoseTheBorderOfARegion", PlantedBug::kKdPointsStrict, compare_points_with_all},
#ifdef LOCUS_X86_KERNELS
    {"KernelWithoutEdgeBound", PlantedBug::kKernelEdgeBound, compare_kernels_with_list},
    {"KernelWithoutTBound", PlantedBug::kKernelTBound, compare_kernels_with_list},
    {"KernelWithoutTreePad", PlantedBug::kKernelTreePad, compare_kernels_with_list},
    {"KernelThatLeavesOutEdgeOnTriangles", PlantedBug::kKernelEdgeOn, compare_kernels_with_list},
    {"KernelThatChoosesItsAxisInFloat", PlantedBug::kKernelFloatAxis, compare_kernels_with_list},
    {"KernelThatTurnsTrianglesOver", PlantedBug::kKernelWinding, compare_kernels_with_list},
    {"KernelThatConfusesSides", PlantedBug::kKernelCull, compare_kernels_with_list},
    {"KernelThatLosesAHitAtTheLimit", PlantedBug::kKernelLimit, compare_kernels_with_list},
    {"KernelWithTiesTheWrongWayRound", PlantedBug::kKernelTie, compare_kernels_with_list},
    {"KernelThatPrunesEqualHits", PlantedBug::kKernelPruneEqual, compare_kernels_with_list},
    {"KernelThatKeepsTheWrongOfEqualRows", PlantedBug::kKernelRowTie, compare_kernels_with_list},
    {"KernelThatAnswersWhatItGaveUp", PlantedBug::kKernelHitAfterGivingUp, compare_kernels_with_list},
    {"KernelBeamOfItsMiddle", PlantedBug::kKernelBeamMiddle, compare_kernels_with_list},
    {"RegionKernelWithoutNodePad", PlantedBug::kRegionReach, compare_region_kernels_with_list},
    {"RegionKernelWithoutInnerPad", PlantedBug::kRegionInside, compare_region_kernels_with_list},
    {"RegionKernelWithoutBoundOfPartingPlanes", PlantedBug::kRegionBeyond, compare_region_kernels_with_list},
    {"RegionKernelWithoutBoundOfEdges", PlantedBug::kRegionNear, compare_region_kernels_with_list},
    {"RegionKernelWithoutBoundOfPlanes", PlantedBug::kRegionPlane, compare_region_kernels_with_list},
    {"RegionKernelWithoutBoundOfWeights", PlantedBug::kRegionWeight, compare_region_kernels_with_list},
    {"RegionKernelWithoutBoundsOfATriangle", PlantedBug::kRegionOwnBounds, compare_region_kernels_with_list},
    {"RegionKernelThatTrustsSquaresThatUnderflow", PlantedBug::kRegionFloor, compare_region_kernels_with_list},
    {"RegionKernelWithoutBoundOfHalfExtents", PlantedBug::kRegionHalf, compare_region_kernels_with_list},
    {"RegionKernelWithoutBoundOfNormals", PlantedBug::kRegionBoxPlane, compare_region_kernels_with_list},
    {"RegionKernelWithoutScaleOfEdges", PlantedBug::kRegionEdgeScale, compare_region_kernels_with_list},
    {"RegionKernelThatDecidesWhatUnderflows", PlantedBug::kRegionRange, compare_region_kernels_with_list},
    {"RegionKernelWithoutPadOfTurnedBoxes", PlantedBug::kRegionTurnedNode, compare_region_kernels_with_list},
    {"NearestKernelWithoutErrorBound", PlantedBug::kNearestError, compare_nearest_kernels_with_list},
    {"NearestKernelWithoutPadOfThePoint", PlantedBug::kNearestPad, compare_nearest_kernels_with_list},
    {"NearestKernelWithoutPadOfBoxes", PlantedBug::kNearestBoxLimit, compare_nearest_kernels_with_list},
    {"NearestKernelThatTrustsSquaresThatUnderflow", PlantedBug::kNearestFloor, compare_nearest_kernels_with_list},
    {"NearestKernelWithoutSlack", PlantedBug::kNearestSlack, compare_nearest_kernels_with_list},
    {"NearestKernelThatKeepsOneLaneLess", PlantedBug::kNearestOtherLane, compare_nearest_kernels_with_list},
    {"NearestKernelThatTrustsNormalsOfSlivers", PlantedBug::kNearestMeasure, compare_nearest_kernels_with_list},
    {"CrossingKernelWithoutErrorBound", PlantedBug::kCrossingError, compare_crossing_kernels_with_list},
    {"CrossingKernelWithoutPadOfThePoint", PlantedBug::kCrossingPad, compare_crossing_kernels_with_list},
    {"CrossingKernelFromTheRoundedPoint", PlantedBug::kHalfLineRounding, compare_crossing_kernels_with_list},
    {"CrossingKernelThatIgnoresSides", PlantedBug::kCrossingNear, compare_crossing_kernels_with_list},
    {"CrossingKernelWithoutHighestVertices", PlantedBug::kCrossingTop, compare_crossing_kernels_with_list},
#endif
};

bool can_run(const Trial& trial) {
#ifdef LOCUS_X86_KERNELS
  if (trial.comparison == compare_kernels_with_list || trial.comparison == compare_region_kernels_with_list ||
      trial.comparison == compare_nearest_kernels_with_list || trial.comparison == compare_crossing_kernels_with_list)
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2");
#endif
  return trial.comparison != nullptr;
}

class PlantedBugTest : public ::testing::TestWithParam<Trial> {
 protected:
  void TearDown() override { planted_bug = PlantedBug::kNone; }
};

TEST_P(PlantedBugTest, IsCaught) {
  if (!can_run(GetParam())) GTEST_SKIP() << "this processor does not run the kernels";
  planted_bug = GetParam().bug;
  const std::string difference = GetParam().comparison();
  EXPECT_NE(difference, "");
  RecordProperty("difference", difference);
}

TEST_P(PlantedBugTest, NothingIsFoundWithoutIt) {
  if (!can_run(GetParam())) GTEST_SKIP() << "this processor does not run the kernels";
  EXPECT_EQ(GetParam().comparison(), "");
}

INSTANTIATE_TEST_SUITE_P(Known, PlantedBugTest, ::testing::ValuesIn(kTrials),
                         [](const auto& trial) { return trial.param.name; });

}  // namespace
}  // namespace locus::test
