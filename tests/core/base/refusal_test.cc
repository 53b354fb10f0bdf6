#include "core/base/refusal.h"

#include "gtest/gtest.h"

namespace locus {
namespace {

TEST(RefusalTest, AStatusCarriesEveryField) {
  Refusal refusal;
  refusal.reason = Reason::kBatchGap;
  refusal.field = "blocks[2].rays.directions";
  refusal.index = 17;
  refusal.limit = "max_queries";
  refusal.limit_value = 65536;
  refusal.asked = 65537.5;
  refusal.retry_after_ms = 250;
  const absl::Status status = refuse(absl::StatusCode::kFailedPrecondition, "send batch 4 first", refusal);
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(status.message(), "blocks[2].rays.directions[17]: send batch 4 first");
  const std::optional<Refusal> back = refusal_of(status);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->reason, refusal.reason);
  EXPECT_EQ(back->field, refusal.field);
  EXPECT_EQ(back->index, refusal.index);
  EXPECT_EQ(back->limit, refusal.limit);
  EXPECT_EQ(back->limit_value, refusal.limit_value);
  EXPECT_EQ(back->asked, refusal.asked);
  EXPECT_EQ(back->retry_after_ms, refusal.retry_after_ms);
}

TEST(RefusalTest, AnIndexOfZeroDiffersFromNoIndex) {
  const absl::Status first = refuse_argument(Reason::kNotFinite, "positions", 0, "is not finite");
  EXPECT_EQ(first.message(), "positions[0]: is not finite");
  EXPECT_EQ(refusal_of(first)->index, std::optional<uint32_t>(0));
  const absl::Status request = refuse_argument(Reason::kColumnLength, "positions", std::nullopt, "has 5 entries");
  EXPECT_EQ(request.message(), "positions: has 5 entries");
  EXPECT_EQ(refusal_of(request)->index, std::nullopt);
  EXPECT_EQ(request.code(), absl::StatusCode::kInvalidArgument);
}

TEST(RefusalTest, ALimitErrorNamesTheLimitItsValueAndTheRequestedValue) {
  const absl::Status status = refuse_limit("blocks", "max_blocks", 256, 257);
  EXPECT_NE(status.message().find("blocks: "), absl::string_view::npos);
  EXPECT_NE(status.message().find("max_blocks"), absl::string_view::npos);
  EXPECT_NE(status.message().find("256"), absl::string_view::npos);
  EXPECT_NE(status.message().find("257"), absl::string_view::npos);
  const std::optional<Refusal> refusal = refusal_of(status);
  ASSERT_TRUE(refusal.has_value());
  EXPECT_EQ(refusal->reason, Reason::kLimit);
  EXPECT_EQ(refusal->limit, "max_blocks");
  EXPECT_EQ(refusal->limit_value, 256);
  EXPECT_EQ(refusal->asked, 257);
}

TEST(RefusalTest, LargeIntegersArePrintedWithoutAnExponent) {
  const absl::Status status = refuse_limit("", "max_bytes", 4e9, 5e9);
  EXPECT_NE(status.message().find("4000000000"), absl::string_view::npos) << status.message();
  EXPECT_EQ(refusal_of(status)->limit_value, 4e9);
}

TEST(RefusalTest, AStatusMadeWithoutARefusalCarriesNone) {
  EXPECT_FALSE(refusal_of(absl::OkStatus()).has_value());
  EXPECT_FALSE(refusal_of(absl::InternalError("disk")).has_value());
}

TEST(RefusalTest, EveryReasonHasItsOwnName) {
  EXPECT_EQ(reason_name(Reason::kUnspecified), "UNSPECIFIED");
  EXPECT_EQ(reason_name(Reason::kNotFinite), "NOT_FINITE");
  EXPECT_EQ(reason_name(Reason::kSceneRestarted), "SCENE_RESTARTED");
  EXPECT_EQ(reason_name(Reason::kHashMismatch), "HASH_MISMATCH");
  EXPECT_EQ(reason_name(Reason::kDamaged), "DAMAGED");
  for (int a = 0; a < static_cast<int>(kLastReason); ++a)
    EXPECT_NE(reason_name(static_cast<Reason>(a)), reason_name(static_cast<Reason>(a + 1)));
  EXPECT_EQ(reason_name(static_cast<Reason>(200)), "UNKNOWN_REASON");
}

}  // namespace
}  // namespace locus
