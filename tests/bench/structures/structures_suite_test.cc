#include "tests/bench/structures/structures_suite.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/bench/structures/structure.h"

namespace locus::bench::structures {
namespace {

TEST(StructuresSuiteTest, TheExponentIsThatOfAPowerLaw) {
  EXPECT_NEAR(exponent_of({1e3, 1e4, 1e5}, {7, 7, 7}), 0, 1e-12);
  EXPECT_NEAR(exponent_of({1e3, 1e4, 1e5}, {5e3, 5e4, 5e5}), 1, 1e-12);
  EXPECT_NEAR(exponent_of({1e3, 1e4, 1e5, 1e6}, {30, 300, 3000, 30'000}), 1, 1e-12);
  EXPECT_NEAR(exponent_of({1, 100}, {1, 10}), 0.5, 1e-12);
}

TEST(StructuresSuiteTest, TheCrossingIsWhereTheRatioRisesToOne) {
  EXPECT_NEAR(crossing_of({10, 100, 1000}, {0.5, 2, 8}), std::sqrt(1000), 1e-9);
  EXPECT_NEAR(crossing_of({10, 100}, {0.5, 1}), 100, 1e-9);
  EXPECT_EQ(crossing_of({10, 100}, {2, 4}), 0);
  EXPECT_EQ(crossing_of({10, 100}, {0.2, 0.4}), 0);
  EXPECT_NEAR(crossing_of({10, 20, 40, 80}, {0.5, 2, 0.5, 2}), 40 * std::sqrt(2), 1e-9);
}

TEST(StructuresSuiteTest, AllStructuresAnswerAlike) {
  for (const SceneKind kind : kScenes) {
    const Scene scene = scene_of(kind, 500);
    const SceneQueries queries = queries_of(scene, 20);
    const auto list = structures().front().make();
    list->build(scene.boxes);
    for (const NamedStructure& named : structures()) {
      const auto structure = named.make();
      structure->build(scene.boxes);
      for (const QueryName query : kQueryNames) {
        for (size_t i = 0; i < 20; ++i) {
          Work work, list_work;
          EXPECT_EQ(structure->answer(query, queries, i, work), list->answer(query, queries, i, list_work))
              << named.name << " " << name_of(kind) << " " << name_of(query) << " " << i;
          EXPECT_GT(list_work.tests, 0u);
        }
      }
    }
  }
}

TEST(StructuresSuiteTest, ABoxLessChangesAnAnswer) {
  Scene scene = scene_of(SceneKind::kUniform, 500);
  const SceneQueries queries = queries_of(scene, 20);
  const auto list = structures().front().make();
  list->build(scene.boxes);
  Work work;
  size_t changed = 0;
  for (size_t i = 0; i < 20; ++i) {
    const uint64_t before = list->answer(QueryName::kNearest, queries, i, work);
    for (const Object& box : scene.boxes) {
      list->remove(box);
      changed += list->answer(QueryName::kNearest, queries, i, work) != before;
      list->insert(box);
    }
  }
  EXPECT_EQ(changed, 20 * kNearestCount);
}

}  // namespace
}  // namespace locus::bench::structures
