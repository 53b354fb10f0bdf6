#include "server/rpc/wire_plan.h"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/unknown_field_set.h>
#include <grpcpp/support/slice.h>
#include <gtest/gtest.h>

#include <string>

#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "grpc/health/v1/health.pb.h"
#include "grpc/reflection/v1alpha/reflection.pb.h"
#include "locus/v1/query_service.pb.h"
#include "locus/v1/scene_service.pb.h"
#include "locus/v1/server_service.pb.h"
#include "locus/v1/update_service.pb.h"
#include "tests/support/random.h"

namespace locus::server {
namespace {

grpc::ByteBuffer to_buffer(const std::string& bytes, size_t slice_bytes = 1 << 20) {
  std::vector<grpc::Slice> slices;
  for (size_t at = 0; at < bytes.size(); at += slice_bytes) slices.emplace_back(bytes.substr(at, slice_bytes));
  if (slices.empty()) slices.emplace_back(std::string());
  return grpc::ByteBuffer(slices.data(), slices.size());
}

template <class Request>
absl::StatusOr<uint64_t> scan(const std::string& bytes, size_t slice_bytes = 1 << 20) {
  return wire_plan<Request>().scan(to_buffer(bytes, slice_bytes));
}

template <class Request>
void expect_limit(const std::string& bytes, const std::string& limit) {
  const absl::StatusOr<uint64_t> scanned = scan<Request>(bytes);
  ASSERT_EQ(scanned.status().code(), absl::StatusCode::kInvalidArgument) << scanned.status();
  EXPECT_EQ(refusal_of(scanned.status())->limit, limit);
}

std::string repeat(const std::string& text, size_t times) {
  std::string all;
  all.reserve(text.size() * times);
  for (size_t i = 0; i < times; ++i) all += text;
  return all;
}

// Returns a length-delimited field whose length is encoded in five bytes.
std::string delimited(int number, const std::string& content) {
  std::string bytes(1, static_cast<char>(number << 3 | 2));
  size_t length = content.size();
  for (int i = 0; i < 4; ++i, length >>= 7) bytes += static_cast<char>(0x80 | (length & 0x7F));
  bytes += static_cast<char>(length);
  return bytes + content;
}

v1::ApplyUpdatesRequest sample_update(int objects) {
  v1::ApplyUpdatesRequest request;
  request.set_scene("world");
  v1::Insert* insert = request.mutable_batch()->add_inserts();
  for (int i = 0; i < objects; ++i) {
    insert->add_ids(static_cast<uint64_t>(i));
    insert->add_positions_f64(1.0);
    insert->mutable_ball()->add_radii(1.0f);
  }
  request.mutable_batch()->add_moves()->add_ids(7);
  return request;
}

TEST(WirePlanTest, AMessageNeedsNoMoreMemoryThanTheScanSays) {
  v1::ApplyUpdatesRequest update = sample_update(1000);
  std::string bytes = update.SerializeAsString();
  ASSERT_TRUE(update.ParseFromString(bytes));
  EXPECT_GE(*scan<v1::ApplyUpdatesRequest>(bytes), update.SpaceUsedLong() - sizeof(update));
  EXPECT_LE(*scan<v1::ApplyUpdatesRequest>(bytes), 3 * update.SpaceUsedLong() + 4096);
  v1::CreateSceneRequest create;
  for (int i = 0; i < 16; ++i) (*create.mutable_spec()->mutable_labels())["key" + std::to_string(i)] = "value";
  bytes = create.SerializeAsString();
  v1::CreateSceneRequest parsed;
  ASSERT_TRUE(parsed.ParseFromString(bytes));
  EXPECT_GE(*scan<v1::CreateSceneRequest>(bytes), parsed.SpaceUsedLong() - sizeof(parsed));
}

// With the first value of a repeated field, Protobuf allocates a header and room for several values.
TEST(WirePlanTest, ShortColumnsNeedNoMoreMemoryThanTheScanSays) {
  const uint64_t empty = v1::QueryBlock().SpaceUsedLong();
  for (int values = 1; values <= 40; ++values) {
    std::string fixed32, fixed64, varints;
    for (int i = 0; i < values; ++i) {
      fixed32 += "\x2D" + std::string(4, '\x01');  // masks
      fixed64 += "\x31" + std::string(8, '\x01');  // ignore_groups
      varints += "\x20\x01";                       // columns
    }
    for (const std::string& bytes : {fixed32, fixed64, varints, fixed32 + fixed64 + varints}) {
      v1::QueryBlock block;
      ASSERT_TRUE(block.ParseFromString(bytes));
      ASSERT_GE(block.masks_size() + block.ignore_groups_size() + block.columns_size(), values);
      EXPECT_LE(block.SpaceUsedLong() - empty, *scan<v1::QueryBlock>(bytes)) << values << " values";
    }
  }
}

TEST(WirePlanTest, UnknownFieldsNeedNoMoreMemoryThanTheScanSays) {
  const uint64_t empty = v1::ApplyUpdatesRequest().SpaceUsedLong();
  for (int fields = 1; fields <= 40; ++fields) {
    for (size_t length = 0; length <= 64; ++length) {
      const std::string bytes = repeat(delimited(15, std::string(length, 'x')), static_cast<size_t>(fields));
      v1::ApplyUpdatesRequest request;
      ASSERT_TRUE(request.ParseFromString(bytes));
      ASSERT_EQ(request.GetReflection()->GetUnknownFields(request).field_count(), fields);
      EXPECT_LE(request.SpaceUsedLong() - empty, *scan<v1::ApplyUpdatesRequest>(bytes))
          << fields << " of " << length << " bytes";
    }
  }
}

TEST(WirePlanTest, EmptySubMessagesAreCountedBeforeTheyExist) {
  const std::string empty_insert(std::string("\x32\x00", 2));
  const std::string lists = repeat(empty_insert, limits::kMaxUpdateLists + 1);
  expect_limit<v1::ApplyUpdatesRequest>(delimited(2, lists), "update_lists");
  expect_limit<v1::ApplyUpdatesRequest>(delimited(2, repeat(empty_insert, 16'000'000)), "update_lists");
  expect_limit<v1::StepRequest>(delimited(2, lists), "update_lists");
  expect_limit<v1::StreamQueriesRequest>(delimited(4, lists), "update_lists");
  // Protobuf merges the copies of a sub-message that occurs more than once, so the counts of all copies add up.
  expect_limit<v1::ApplyUpdatesRequest>(repeat(delimited(2, repeat(empty_insert, 1000)), 100), "update_lists");
  EXPECT_TRUE(scan<v1::ApplyUpdatesRequest>(delimited(2, repeat(empty_insert, limits::kMaxUpdateLists))).ok());
}

TEST(WirePlanTest, ListsOfPartsAreCountedOverAllCompounds) {
  const std::string empty_parts(std::string("\x0a\x00", 2));
  const std::string insert = delimited(6, delimited(12, repeat(empty_parts, 1000)));
  EXPECT_TRUE(scan<v1::ApplyUpdatesRequest>(delimited(2, repeat(insert, 65))).ok());
  expect_limit<v1::ApplyUpdatesRequest>(delimited(2, repeat(insert, 66)), "update_lists");
}

TEST(WirePlanTest, FieldsAreCounted) {
  const std::string flag("\x18\x01");
  expect_limit<v1::ApplyUpdatesRequest>(delimited(2, repeat(flag, kMaxWireFields)), "wire_fields");
  const std::string unknown("\x78\x01");
  expect_limit<v1::ApplyUpdatesRequest>(repeat(unknown, kMaxUnknownFields + 1), "unknown_fields");
  EXPECT_TRUE(scan<v1::ApplyUpdatesRequest>(repeat(unknown, kMaxUnknownFields)).ok());
}

TEST(WirePlanTest, BlocksAndLabelsHaveTheirLimits) {
  v1::QueryRequest query;
  for (uint32_t i = 0; i <= limits::kMaxBlocks; ++i) query.mutable_batch()->add_blocks();
  expect_limit<v1::QueryRequest>(query.SerializeAsString(), "blocks");
  v1::CreateSceneRequest create;
  for (uint32_t i = 0; i <= limits::kMaxLabels; ++i) (*create.mutable_spec()->mutable_labels())[std::to_string(i)] = "";
  expect_limit<v1::CreateSceneRequest>(create.SerializeAsString(), "labels");
  v1::UploadMeshRequest upload;
  for (uint32_t i = 0; i <= limits::kMaxMeshParts; ++i) upload.add_parts();
  expect_limit<v1::UploadMeshRequest>(upload.SerializeAsString(), "mesh_parts");
}

TEST(WirePlanTest, BytesThatAreNoMessageAreRefused) {
  for (const std::string& bytes : {
           std::string("\x12\x7F"),                  // a sub-message longer than the message
           std::string("\x12\x03\x32\x05\x01"),      // a list longer than its batch
           std::string("\x00\x01", 2),               // field number 0
           std::string("\x0B\x0C"),                  // a group
           std::string("\x0F\x01"),                  // wire type 7
           std::string("\x0A\xFF\xFF\xFF\xFF\x7F"),  // a length beyond every message
           std::string(20, '\xFF'),
       })
    EXPECT_EQ(scan<v1::ApplyUpdatesRequest>(bytes).status().code(), absl::StatusCode::kInvalidArgument)
        << testing::PrintToString(bytes);
}

// Returns whether the message, or a message inside it, has an unknown field that is a group.
bool has_group(const google::protobuf::Message& message) {
  const google::protobuf::Reflection& reflection = *message.GetReflection();
  const google::protobuf::UnknownFieldSet& unknown = reflection.GetUnknownFields(message);
  for (int i = 0; i < unknown.field_count(); ++i)
    if (unknown.field(i).type() == google::protobuf::UnknownField::TYPE_GROUP) return true;
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const google::protobuf::FieldDescriptor* field : fields) {
    if (field->cpp_type() != google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (!field->is_repeated() && has_group(reflection.GetMessage(message, field))) return true;
    for (int i = 0; field->is_repeated() && i < reflection.FieldSize(message, field); ++i)
      if (has_group(reflection.GetRepeatedMessage(message, field, i))) return true;
  }
  return false;
}

// The scan must accept every message that Protobuf parses, except messages with groups, and must not underestimate the
// memory of an accepted message.
TEST(WirePlanTest, RandomlyChangedMessagesAreAcceptedIfProtobufParsesThem) {
  constexpr uint64_t kSeed = 20261123;
  test::Random random(kSeed);
  const std::string whole = sample_update(3).SerializeAsString();
  int accepted = 0;
  for (int round = 0; round < 20'000; ++round) {
    std::string bytes = whole.substr(0, random.below(3) == 0 ? random.below(whole.size()) : whole.size());
    for (uint64_t changes = random.below(4); changes > 0 && !bytes.empty(); --changes)
      bytes[random.below(bytes.size())] = static_cast<char>(random.below(256));
    v1::ApplyUpdatesRequest request;
    const bool good = request.ParseFromString(bytes);
    const absl::StatusOr<uint64_t> scanned = scan<v1::ApplyUpdatesRequest>(bytes, 1 + random.below(64));
    if (!good) continue;
    if (has_group(request)) continue;  // the scan refuses groups, which Protobuf keeps as unknown fields
    ASSERT_TRUE(scanned.ok()) << scanned.status() << ", round " << round << ", seed " << kSeed;
    ++accepted;
    EXPECT_GE(*scanned + sizeof(request), request.SpaceUsedLong()) << "round " << round << ", seed " << kSeed;
  }
  EXPECT_GT(accepted, 100);
}

TEST(WirePlanTest, EveryRequestTypeHasAPlan) {
  // The linker keeps the code of a proto file only if the program uses something of it, so use a message of each file.
  for (const google::protobuf::Descriptor* message :
       {v1::QueryRequest::descriptor(), v1::CreateSceneRequest::descriptor(), v1::GetServerRequest::descriptor(),
        v1::ApplyUpdatesRequest::descriptor(), grpc::health::v1::HealthCheckRequest::descriptor(),
        grpc::reflection::v1alpha::ServerReflectionRequest::descriptor()}) {
    const google::protobuf::FileDescriptor& file = *message->file();
    ASSERT_LE(1, file.service_count()) << file.name();
    for (int i = 0; i < file.service_count(); ++i)
      for (int k = 0; k < file.service(i)->method_count(); ++k)
        WirePlan(*file.service(i)->method(k)->input_type(), request_limits());
  }
}

TEST(WirePlanDeathTest, ARepeatedFieldWithoutALimitIsRefusedWhenThePlanIsBuilt) {
  EXPECT_DEATH(WirePlan(*v1::ApplyUpdatesRequest::descriptor(), {}), "UpdateBatch.inserts");
}

}  // namespace
}  // namespace locus::server
