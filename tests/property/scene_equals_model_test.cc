// Applies thousands of random batches to scenes and to a model, which applies one item after another to a std::map. A
// scene and its model must have equal contents.
#include <gtest/gtest.h>

#include "tests/support/scene_lockstep.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

TEST(SceneEqualsModelTest, ThroughManyShortLives) { EXPECT_EQ(search_scene_lockstep(scaled_count(100), 60), ""); }

TEST(SceneEqualsModelTest, ThroughLongLives) {
  EXPECT_EQ(search_scene_lockstep(4, static_cast<int>(scaled_count(2000))), "");
}

}  // namespace
}  // namespace locus::test
