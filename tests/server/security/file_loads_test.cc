#include "server/security/file_loads.h"

#include <gtest/gtest.h>

namespace locus::server {
namespace {

TEST(FileLoadsTest, ABadFileIsCountedAndTheTimeOfTheFilesInUseStays) {
  FileLoads loads;
  EXPECT_EQ(loads.loaded_s(), 0);
  loads.start(1000);
  EXPECT_EQ(loads.loaded_s(), 1000);
  EXPECT_FALSE(loads.refused());
  loads.record(absl::InvalidArgumentError("bad"), 1010);
  EXPECT_EQ(loads.failures(), 1u);
  EXPECT_EQ(loads.reloads(), 0u);
  EXPECT_EQ(loads.loaded_s(), 1000);
  EXPECT_TRUE(loads.refused());
}

TEST(FileLoadsTest, AGoodFileEndsTheAlarmAndCountsAsLoaded) {
  FileLoads loads;
  loads.start(1000);
  loads.record(absl::InvalidArgumentError("bad"), 1010);
  loads.record(absl::OkStatus(), 1020);
  EXPECT_EQ(loads.failures(), 1u);
  EXPECT_EQ(loads.reloads(), 1u);
  EXPECT_EQ(loads.loaded_s(), 1020);
  EXPECT_FALSE(loads.refused());
}

}  // namespace
}  // namespace locus::server
