#include "server/rpc/receive.h"

#include <grpcpp/support/slice.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "locus/v1/query_service.pb.h"
#include "locus/v1/update_service.pb.h"
#include "tests/support/random.h"

namespace locus::server {
namespace {

grpc::ByteBuffer in_slices(const std::string& bytes, size_t slice_bytes = 1 << 20) {
  std::vector<grpc::Slice> slices;
  for (size_t at = 0; at < bytes.size(); at += slice_bytes) slices.emplace_back(bytes.substr(at, slice_bytes));
  if (slices.empty()) slices.emplace_back(std::string());
  return grpc::ByteBuffer(slices.data(), slices.size());
}

v1::StreamQueriesRequest sample_query() {
  v1::StreamQueriesRequest request;
  request.set_scene("world");
  request.set_sequence(77);
  request.mutable_batch()->add_blocks()->mutable_rays()->mutable_origins()->Resize(3000, 1.f);
  return request;
}

TEST(ReceiveTest, AnEnvelopeHasTheNumbersAndNamesOfAMessageButNotItsBatch) {
  for (const size_t slice_bytes : {1u, 7u, 1u << 20}) {
    v1::StreamQueriesRequest envelope;
    ASSERT_TRUE(parse_envelope(in_slices(sample_query().SerializeAsString(), slice_bytes), envelope));
    EXPECT_EQ(envelope.scene(), "world");
    EXPECT_EQ(envelope.sequence(), 77u);
    EXPECT_FALSE(envelope.has_batch());
  }
}

TEST(ReceiveTest, LongTextsAreLeftOutAndTooManyFieldsAreRefused) {
  v1::StreamQueriesRequest request = sample_query(), envelope;
  request.set_scene(std::string(1000, 'x'));
  ASSERT_TRUE(parse_envelope(in_slices(request.SerializeAsString()), envelope));
  EXPECT_EQ(envelope.scene(), "");
  EXPECT_EQ(envelope.sequence(), 77u);
  request.clear_scene();
  std::string repeated;
  while (repeated.size() < 4096) repeated += request.SerializeAsString();
  EXPECT_TRUE(parse_envelope(in_slices(repeated), envelope));
  request.clear_batch();
  repeated.clear();
  while (repeated.size() < 4096) repeated += request.SerializeAsString();
  EXPECT_FALSE(parse_envelope(in_slices(repeated), envelope));
}

TEST(ReceiveTest, DamagedBytesHaveNoEnvelopeOrAnotherOne) {
  const std::string good = sample_query().SerializeAsString();
  v1::StreamQueriesRequest envelope;
  for (size_t length = 0; length < 20; ++length) parse_envelope(in_slices(good.substr(0, length)), envelope);
  EXPECT_FALSE(parse_envelope(in_slices(good.substr(0, good.size() - 1)), envelope));
  for (uint64_t seed = 1; seed <= 1000; ++seed) {
    test::Random random(seed);
    std::string damaged = good;
    damaged[random.below(damaged.size())] = static_cast<char>(random.next());
    parse_envelope(in_slices(damaged), envelope);
  }
}

TEST(ReceiveTest, AFlagOfASubMessageIsReadWithoutTheRest) {
  const auto flag_of = [](const std::string& bytes, size_t slice_bytes = 1 << 20) {
    return read_flag(in_slices(bytes, slice_bytes), v1::StreamUpdatesRequest::kBatchFieldNumber,
                     v1::UpdateBatch::kContinuesFieldNumber);
  };
  v1::StreamUpdatesRequest request;
  request.set_scene("world");
  request.set_sequence(3);
  EXPECT_EQ(flag_of(request.SerializeAsString()), std::optional<bool>(false));
  request.mutable_batch()->mutable_remove_ids()->Resize(3000, 17);
  EXPECT_EQ(flag_of(request.SerializeAsString()), std::optional<bool>(false));
  request.mutable_batch()->set_continues(true);
  for (const size_t slice_bytes : {1u, 7u, 1u << 20})
    EXPECT_EQ(flag_of(request.SerializeAsString(), slice_bytes), std::optional<bool>(true));
  // Several sub-messages are merged, like Protobuf does it.
  v1::StreamUpdatesRequest other;
  other.mutable_batch()->add_remove_ids(1);
  EXPECT_EQ(flag_of(request.SerializeAsString() + other.SerializeAsString()), std::optional<bool>(true));
  const std::string bytes = request.SerializeAsString();
  EXPECT_EQ(flag_of(bytes.substr(0, bytes.size() - 1)), std::nullopt);
  EXPECT_EQ(flag_of("\x1f\x8b\x08 compressed"), std::nullopt);
}

}  // namespace
}  // namespace locus::server
