// Rows about the parts of compounds equal, bit for bit, the rows about a scene in which every part is an object of its
// own, for all kinds of queries that have such rows, exactly and by bounds.
#include <gtest/gtest.h>

#include "tests/support/part_scenes.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

TEST(CompoundsEqualPartsTest, RandomAndAdversarialScenes) { EXPECT_EQ(search_part_scenes(scaled_count(3'000)), ""); }

}  // namespace
}  // namespace locus::test
