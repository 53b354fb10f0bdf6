#include "tests/bench/frame/peer_library.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace locus::bench {
namespace {

TEST(PeerLibraryTest, MissingLibrariesAreReportedByTheirPackage) {
  EXPECT_THAT(missing_peers({{"libhere-dev", true}, {"libgone-dev", false}}),
              testing::ElementsAre("a peer is missing: libgone-dev was not installed when this program was configured; "
                                   "run deploy/packages.sh bench"));
}

}  // namespace
}  // namespace locus::bench
