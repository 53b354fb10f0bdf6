// Tests one writer at full speed and concurrent readers. The readers compare the latest revision, and random past
// ticks, with a model. tests/property/scene_proof_test.cc runs the same test for ten minutes.
#include <gtest/gtest.h>

#include "tests/support/full_speed.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

TEST(RunBatchFullSpeedTest, EveryReaderSeesTheModelAtItsRevisionAndInItsPast) {
  const FullSpeedResult result = run_at_full_speed({400, 3, 1}, [](const FullSpeedResult& so_far) {
    return so_far.revisions < scaled_count(1'000) || so_far.past_looks < scaled_count(300);
  });
  EXPECT_EQ(result.difference, "");
}

}  // namespace
}  // namespace locus::test
