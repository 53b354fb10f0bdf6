// Queries about the history of scenes with random updates, compared with a model that stores all objects at every tick.
#include <gtest/gtest.h>

#include "tests/support/rewind_lockstep.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

TEST(RewindEqualsModelTest, ThroughManyShortLives) { EXPECT_EQ(search_rewind_lockstep(scaled_count(70), 60), ""); }

TEST(RewindEqualsModelTest, ThroughTicksOfManyBatches) {
  EXPECT_EQ(search_rewind_lockstep(scaled_count(70), 60, kTicksOfManyBatches), "");
}

TEST(RewindEqualsModelTest, ThroughLongLives) {
  EXPECT_EQ(search_rewind_lockstep(4, static_cast<int>(scaled_count(600))), "");
}

}  // namespace
}  // namespace locus::test
