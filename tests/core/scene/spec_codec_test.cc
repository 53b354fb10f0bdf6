#include "core/scene/spec_codec.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/base/limits.h"
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

TEST(SpecCodecTest, LifetimesRoundTripWithAndWithoutACreator) {
  for (const char* const creator : {"token:ci", ""}) {
    SceneSpec spec = full_spec();
    spec.creator = creator;
    spec.idle_ttl_s = 90;
    const std::string bytes = encode_spec(spec);
    EXPECT_EQ(bytes.substr(0, 4), "LSLS");
    absl::StatusOr<SceneSpec> decoded = decode_spec(bytes);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(decoded->idle_ttl_s, 90u);
    EXPECT_EQ(decoded->mesh_grace_s, 0u);
    EXPECT_EQ(decoded->creator, creator);
    EXPECT_EQ(decoded->labels, spec.labels);
    spec.idle_ttl_s = 0;
    spec.mesh_grace_s = limits::kMaxLifetimeSeconds;
    decoded = decode_spec(encode_spec(spec));
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(decoded->idle_ttl_s, 0u);
    EXPECT_EQ(decoded->mesh_grace_s, limits::kMaxLifetimeSeconds);
  }
}

TEST(SpecCodecTest, ACellSizeRoundTripsAndOneOutOfRangeIsDamage) {
  SceneSpec spec = full_spec();
  spec.mesh_grace_s = 7;
  for (const double size : {kMinCellSize, 4.0, kMaxCellSize}) {
    spec.cell_size = size;
    const std::string bytes = encode_spec(spec);
    EXPECT_EQ(bytes.substr(0, 4), "LSZS");
    const absl::StatusOr<SceneSpec> decoded = decode_spec(bytes);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(decoded->cell_size, size);
    EXPECT_EQ(decoded->mesh_grace_s, 7u);
    EXPECT_EQ(decoded->creator, spec.creator);
  }
  for (const double size : {-1.0, kMaxCellSize * 2, std::numeric_limits<double>::quiet_NaN()}) {
    spec.cell_size = size;
    EXPECT_EQ(decode_spec(encode_spec(spec)).status().code(), absl::StatusCode::kDataLoss) << size;
  }
}

TEST(SpecCodecTest, ALifetimeBeyondTheLimitIsDamage) {
  SceneSpec spec = full_spec();
  spec.idle_ttl_s = limits::kMaxLifetimeSeconds + 1;
  EXPECT_EQ(decode_spec(encode_spec(spec)).status().code(), absl::StatusCode::kDataLoss);
}

// Scene specifications of the data formats 3 and 4 have no lifetimes. They must stay readable.
TEST(SpecCodecTest, ASpecificationWithoutLifetimesIsWrittenAsInFormat4) {
  SceneSpec spec = full_spec();
  const std::string bytes = encode_spec(spec);
  EXPECT_EQ(bytes.substr(0, 4), "LSOS");
  spec.mesh_grace_s = 1;
  EXPECT_EQ(encode_spec(spec).substr(4, bytes.size() - 4), bytes.substr(4));
}

TEST(SpecCodecTest, DamagedBytesNeverHarm) {
  Random random(1);
  SceneSpec limited = full_spec();
  limited.idle_ttl_s = 3600;
  const std::string bytes = encode_spec(limited);
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
