#include "server/rpc/receive.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>
#include <grpcpp/support/proto_buffer_writer.h>

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/check.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/rpc/inflate.h"

namespace locus::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;
using google::protobuf::io::CodedOutputStream;
using google::protobuf::io::StringOutputStream;

// Maximum size in bytes of a slice of a response.
constexpr int kSliceBytes = 1 << 20;

// Maximum sizes in bytes of one text in an envelope, and of all fields of an envelope. See parse_envelope(). Names of
// scenes are shorter than the maximum of a text.
constexpr uint32_t kMaxEnvelopeText = 256;
constexpr int kMaxEnvelopeBytes = 2048;

// Copies one field of a message of the type `type` from `from` to `to` if the field is a number or a short text;
// otherwise skips it. Returns false for a group, and if the bytes end within the field.
bool copy_scalar(uint32_t tag, const Descriptor& type, CodedInputStream& from, CodedOutputStream& to) {
  const FieldDescriptor* const field = type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
  const WireFormatLite::WireType wire = WireFormatLite::GetTagWireType(tag);
  if (wire == WireFormatLite::WIRETYPE_START_GROUP || wire == WireFormatLite::WIRETYPE_END_GROUP) return false;
  if (wire != WireFormatLite::WIRETYPE_LENGTH_DELIMITED)
    return field == nullptr ? WireFormatLite::SkipField(&from, tag) : WireFormatLite::SkipField(&from, tag, &to);
  uint32_t length = 0;
  if (!from.ReadVarint32(&length) || length > INT32_MAX) return false;
  const bool is_text = field != nullptr && field->cpp_type() == FieldDescriptor::CPPTYPE_STRING;
  if (!is_text || length > kMaxEnvelopeText) return from.Skip(static_cast<int>(length));
  std::string text;
  if (!from.ReadString(&text, static_cast<int>(length))) return false;
  to.WriteTag(tag);
  to.WriteVarint32(length);
  to.WriteString(text);
  return true;
}

}  // namespace

absl::StatusOr<CallMemory> parse_request(const Caller& caller, const WirePlan& plan, grpc::ByteBuffer& bytes,
                                         google::protobuf::Message& request) {
  const auto claim_bytes = [&caller](uint64_t amount) { return caller.claim(MemoryLine::kRequests, "", amount); };
  std::vector<CallMemory> inflated;  // held until the message is parsed
  if (caller.state().max_inflated_bytes > 0 && is_gzip(bytes)) {
    ASSIGN_OR_RETURN(inflated, inflate_gzip(claim_bytes, caller.state().max_inflated_bytes, bytes));
  }
  ASSIGN_OR_RETURN(const uint64_t parsed, plan.scan(bytes));
  ASSIGN_OR_RETURN(CallMemory claim, claim_bytes(parsed));
  bool good = false;
  {
    grpc::ProtoBufferReader reader(&bytes);
    good = request.ParseFromZeroCopyStream(&reader);
  }
  bytes.Clear();
  if (good) return claim;
  return refuse_argument(Reason::kMalformed, "", {}, "the bytes are no message of this call's type");
}

bool parse_envelope(const grpc::ByteBuffer& bytes, google::protobuf::Message& request) {
  grpc::ByteBuffer borrowed(bytes);  // shares the slices; the reader needs a pointer to a non-const buffer
  grpc::ProtoBufferReader reader(&borrowed);
  if (!reader.status().ok()) return false;
  CodedInputStream in(&reader);
  std::string fields;
  {
    StringOutputStream stream(&fields);
    CodedOutputStream out(&stream);
    while (const uint32_t tag = in.ReadTag())
      if (!copy_scalar(tag, *request.GetDescriptor(), in, out) || out.ByteCount() > kMaxEnvelopeBytes) return false;
  }
  return in.ConsumedEntireMessage() && request.ParseFromString(fields);
}

std::optional<bool> read_flag(const grpc::ByteBuffer& bytes, int parent, int number) {
  grpc::ByteBuffer borrowed(bytes);  // shares the slices; the reader needs a pointer to a non-const buffer
  grpc::ProtoBufferReader reader(&borrowed);
  if (!reader.status().ok()) return std::nullopt;
  CodedInputStream in(&reader);
  bool flag = false;
  while (const uint32_t tag = in.ReadTag()) {
    uint32_t length = 0;
    if (tag != WireFormatLite::MakeTag(parent, WireFormatLite::WIRETYPE_LENGTH_DELIMITED)) {
      if (!WireFormatLite::SkipField(&in, tag)) return std::nullopt;
      continue;
    }
    if (!in.ReadVarint32(&length) || length > INT32_MAX) return std::nullopt;
    const CodedInputStream::Limit limit = in.PushLimit(static_cast<int>(length));
    while (const uint32_t inner = in.ReadTag()) {
      uint64_t value = 0;
      const bool is_flag = inner == WireFormatLite::MakeTag(number, WireFormatLite::WIRETYPE_VARINT);
      if (is_flag ? !in.ReadVarint64(&value) : !WireFormatLite::SkipField(&in, inner)) return std::nullopt;
      if (is_flag) flag = value != 0;
    }
    if (!in.ConsumedEntireMessage() || in.BytesUntilLimit() != 0) return std::nullopt;
    in.PopLimit(limit);
  }
  return in.ConsumedEntireMessage() ? std::optional<bool>(flag) : std::nullopt;
}

grpc::ByteBuffer to_bytes(const google::protobuf::Message& response) {
  grpc::ByteBuffer bytes;
  const size_t size = response.ByteSizeLong();
  LOCUS_CHECK_LE(size, size_t{INT32_MAX});  // responses are far below the maximum size of a message
  bool written = false;
  {
    grpc::ProtoBufferWriter writer(&bytes, kSliceBytes, static_cast<int>(size));
    written = response.SerializeToZeroCopyStream(&writer);
  }
  LOCUS_CHECK(written);
  return bytes;
}

}  // namespace locus::server
