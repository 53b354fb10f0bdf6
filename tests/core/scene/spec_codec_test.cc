#include "core/scene/spec_codec.h"

#include <gtest/gtest.h>

#include "tests/support/damaged_bytes.h"
#include "tests/support/test_scale.h"

namespace locus::test {
namespace {

SceneSpec full_spec() {
  SceneSpec spec;
  spec.labels = {{"map", "harbour"}, {"", ""}};
  spec.winding = Winding::kClockwise;
  spec.history = {100, 12345};
  spec.pinned_bytes = 77;
  spec.overload = OverloadPolicy::kLatestWins;
  spec.durability = Durability::kMemory;
  spec.creator = "token:ci";
  return spec;
}

TEST(SpecCodecTest, ASpecificationRoundTrips) {
  const absl::StatusOr<SceneSpec> spec = decode_spec(encode_spec(full_spec()));
  ASSERT_TRUE(spec.ok()) << spec.status();
  EXPECT_EQ(spec->labels, full_spec().labels);
  EXPECT_EQ(spec->winding, Winding::kClockwise);
  EXPECT_EQ(spec->history.ticks, 100u);
  EXPECT_EQ(spec->history.bytes, 12345u);
  EXPECT_EQ(spec->pinned_bytes, 77u);
  EXPECT_EQ(spec->overload, OverloadPolicy::kLatestWins);
  EXPECT_EQ(spec->durability, Durability::kMemory);
  EXPECT_EQ(spec->creator, "token:ci");
}

// Scene specifications of the data formats 1 and 2 have no creator. They must stay readable.
TEST(SpecCodecTest, ASpecificationWithoutACreatorIsWrittenAsInFormat2) {
  SceneSpec spec = full_spec();
  const std::string owned = encode_spec(spec);
  spec.creator.clear();
  const std::string bytes = encode_spec(spec);
  EXPECT_EQ(bytes.substr(0, 4), "LSSP");
  EXPECT_EQ(owned.substr(0, 4), "LSOS");
  EXPECT_EQ(bytes.substr(4), owned.substr(4, bytes.size() - 4));
  ASSERT_TRUE(decode_spec(bytes).ok());
  EXPECT_EQ(decode_spec(bytes)->creator, "");
}

TEST(SpecCodecTest, DamagedBytesNeverHarm) {
  Random random(1);
  const std::string bytes = encode_spec(full_spec());
  uint64_t refused = 0;
  for (uint64_t i = 0; i < scaled_count(20000); ++i) {
    const absl::Status status = decode_spec(damaged(bytes, random)).status();
    EXPECT_TRUE(status.ok() || absl::IsDataLoss(status)) << status;
    refused += status.ok() ? 0 : 1;
  }
  EXPECT_NE(refused, 0u);
}

}  // namespace
}  // namespace locus::test
