// Moves, relabels, removes and places instances of scenes with history, and compares them at random past times with
// copies of every tick.
#include <gtest/gtest.h>

#include "tests/support/door_lockstep.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

TEST(DoorsEqualModelTest, AtRandomTimes) { EXPECT_EQ(search_door_lockstep(scaled_count(40), 40), ""); }

}  // namespace
}  // namespace locus::test
