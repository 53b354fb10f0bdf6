#include "server/rpc/wire_plan.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/message.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <algorithm>
#include <utility>

#include "absl/container/inlined_vector.h"
#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/limits.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"

namespace locus::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MessageFactory;
using google::protobuf::io::CodedInputStream;

// Repeated fields double their capacity as they grow.
constexpr uint64_t kGrowth = 2;
// Bytes of a column's header and of the space that Protobuf allocates for the first values, in addition to kGrowth
// times the bytes of the values.
constexpr uint64_t kColumnBytes = 16;
// Bytes of a string object with its allocation; bytes of an entry in a list of pointers, with the overhead of
// allocating the object that it points to.
constexpr uint64_t kStringBytes = 64;
constexpr uint64_t kPointerBytes = 32;
// Bytes of a map's node in addition to the key and the value.
constexpr uint64_t kMapNodeBytes = 64;
// Bytes that Protobuf keeps for an unknown field in addition to its content: the set of unknown fields of its message
// (40), two entries in that set (32), and a string object with the unused rest of its allocation (48).
constexpr uint64_t kUnknownBytes = 128;

// Types of values on the wire, with Protobuf's numbers.
enum class Wire : uint8_t { kVarint = 0, kFixed64 = 1, kDelimited = 2, kStartGroup = 3, kEndGroup = 4, kFixed32 = 5 };
constexpr uint32_t kWireBits = 3;  // lowest bits of a tag; the others are the field's number

Wire wire_of(const FieldDescriptor& field) {
  switch (field.type()) {
    case FieldDescriptor::TYPE_DOUBLE:
    case FieldDescriptor::TYPE_FIXED64:
    case FieldDescriptor::TYPE_SFIXED64:
      return Wire::kFixed64;
    case FieldDescriptor::TYPE_FLOAT:
    case FieldDescriptor::TYPE_FIXED32:
    case FieldDescriptor::TYPE_SFIXED32:
      return Wire::kFixed32;
    case FieldDescriptor::TYPE_STRING:
    case FieldDescriptor::TYPE_BYTES:
    case FieldDescriptor::TYPE_MESSAGE:
      return Wire::kDelimited;
    case FieldDescriptor::TYPE_GROUP:
      return Wire::kStartGroup;
    default:
      return Wire::kVarint;
  }
}

absl::Status no_message() {
  return refuse_argument(Reason::kMalformed, "", {}, "the bytes are no message of this call's type");
}

// Returns the bytes that one value of a numeric field takes in memory; 0 for other fields.
uint32_t bytes_of_value(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
    case FieldDescriptor::CPPTYPE_UINT32:
    case FieldDescriptor::CPPTYPE_FLOAT:
    case FieldDescriptor::CPPTYPE_ENUM:
      return 4;
    case FieldDescriptor::CPPTYPE_INT64:
    case FieldDescriptor::CPPTYPE_UINT64:
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return 8;
    case FieldDescriptor::CPPTYPE_BOOL:
      return 1;
    case FieldDescriptor::CPPTYPE_STRING:
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return 0;
  }
  return 0;
}

// Limits of the fields of requests. Checks after parsing use the same limits.
const std::vector<WireLimit> kRequestLimits = {
    {"locus.v1.QueryBatch.blocks", "blocks", "blocks", limits::kMaxBlocks},
    {"locus.v1.UpdateBatch.inserts", "inserts", "update_lists", limits::kMaxUpdateLists},
    {"locus.v1.UpdateBatch.moves", "moves", "update_lists", limits::kMaxUpdateLists},
    {"locus.v1.UpdateBatch.relabels", "relabels", "update_lists", limits::kMaxUpdateLists},
    {"locus.v1.UpdateBatch.instance_moves", "instance_moves", "update_lists", limits::kMaxUpdateLists},
    {"locus.v1.UpdateBatch.instance_relabels", "instance_relabels", "update_lists", limits::kMaxUpdateLists},
    {"locus.v1.Compound.parts", "compound.parts", "update_lists", limits::kMaxUpdateLists},
    {"locus.v1.ChangeInstancesRequest.place", "place", "update_lists", limits::kMaxUpdateLists},
    {"locus.v1.UploadMeshRequest.parts", "parts", "mesh_parts", limits::kMaxMeshParts},
    {"locus.v1.SceneSpec.labels", "spec.labels", "labels", limits::kMaxLabels},
    {"locus.v1.ListScenesRequest.labels", "labels", "labels", limits::kMaxLabels},
    {"locus.v1.UpdateSceneRequest.fields", "fields", "fields", limits::kMaxLabels},
    {"locus.v1.UpdateSceneRequest.labels", "labels", "labels", limits::kMaxLabels},
};

}  // namespace

const std::vector<WireLimit>& request_limits() { return kRequestLimits; }

// Field of a message type.
struct WirePlan::Field {
  enum class Kind : uint8_t { kUnknown, kScalar, kColumn, kString, kMessage };
  Kind kind = Kind::kUnknown;
  Wire wire = Wire::kVarint;  // type of one value
  uint32_t value_bytes = 0;   // columns: bytes of one value in memory
  uint32_t overhead = 0;      // strings and messages: bytes in memory in addition to the content
  const Type* type = nullptr;
  const WireLimit* limit = nullptr;  // null: not a repeated string or message
  uint32_t limit_index = 0;          // index of `limit` among the limits of the plan
};

struct WirePlan::Type {
  std::vector<Field> fields;  // the index is the field number; numbers without a field have kUnknown
};

// State of one scan.
struct WirePlan::Scan {
  CodedInputStream& in;
  uint64_t memory = 0;
  uint32_t fields = 0;
  uint32_t unknown = 0;
  // Number of values scanned so far for each limit, indexed by limit_index; grows as needed.
  absl::InlinedVector<uint32_t, 16> counts;

  absl::Status message(const Type& type);
  absl::Status field(const Type& type, uint32_t tag);
  absl::Status column(const Field& field, Wire wire);
  absl::Status content(const Field& field);
  absl::Status unknown_field(Wire wire);
  absl::Status count(const Field& field);
  bool skip(Wire wire, uint32_t* bytes);
};

// Skips the value of a field. Returns false for an invalid value and for a group: no message of this protocol has
// groups, and groups may nest.
bool WirePlan::Scan::skip(Wire wire, uint32_t* bytes) {
  uint64_t value = 0;
  uint32_t length = 0;
  switch (wire) {
    case Wire::kVarint:
      return in.ReadVarint64(&value);
    case Wire::kFixed32:
      return in.Skip(4);
    case Wire::kFixed64:
      return in.Skip(8);
    case Wire::kDelimited:
      if (!in.ReadVarint32(&length) || length > INT32_MAX) return false;
      *bytes = length;
      return in.Skip(static_cast<int>(length));
    case Wire::kStartGroup:
    case Wire::kEndGroup:
      return false;
  }
  return false;
}

absl::Status WirePlan::Scan::unknown_field(Wire wire) {
  uint32_t bytes = 0;
  if (!skip(wire, &bytes)) return no_message();
  memory += kUnknownBytes + bytes;
  if (++unknown <= kMaxUnknownFields) return absl::OkStatus();
  return refuse_limit("", "unknown_fields", kMaxUnknownFields, unknown);
}

absl::Status WirePlan::Scan::count(const Field& field) {
  if (field.limit == nullptr) return absl::OkStatus();
  if (counts.size() <= field.limit_index) counts.resize(field.limit_index + 1);
  const uint32_t values = ++counts[field.limit_index];
  if (values <= field.limit->max) return absl::OkStatus();
  return refuse_limit(field.limit->path, field.limit->limit, field.limit->max, values);
}

// Counts the memory of one encoded field of a column. An encoded field contains any number of values (packed) or a
// single value; both forms are legal. Each encoded field is charged kColumnBytes, although all encoded fields of a
// column share one header.
absl::Status WirePlan::Scan::column(const Field& field, Wire wire) {
  uint32_t bytes = 0;
  if (!skip(wire, &bytes)) return no_message();
  const bool packed = wire == Wire::kDelimited;
  const uint64_t shortest = field.wire == Wire::kVarint ? 1 : field.value_bytes;
  memory += kColumnBytes + kGrowth * field.value_bytes * (packed ? bytes / shortest : 1);
  return absl::OkStatus();
}

absl::Status WirePlan::Scan::content(const Field& field) {
  RETURN_IF_ERROR(count(field));
  memory += field.overhead;
  if (field.kind == Field::Kind::kString) {
    uint32_t bytes = 0;
    if (!skip(Wire::kDelimited, &bytes)) return no_message();
    memory += bytes;
    return absl::OkStatus();
  }
  uint32_t length = 0;
  if (!in.ReadVarint32(&length) || length > INT32_MAX) return no_message();
  const CodedInputStream::Limit outer = in.PushLimit(static_cast<int>(length));
  if (in.BytesUntilLimit() != static_cast<int>(length)) return no_message();  // the field extends beyond its message
  RETURN_IF_ERROR(message(*field.type));
  in.PopLimit(outer);
  return absl::OkStatus();
}

absl::Status WirePlan::Scan::field(const Type& type, uint32_t tag) {
  if (++fields > kMaxWireFields) return refuse_limit("", "wire_fields", kMaxWireFields, fields);
  const size_t number = tag >> kWireBits;
  const auto wire = static_cast<Wire>(tag & ((1u << kWireBits) - 1));
  static const Field kNoField;
  const Field& known = number < type.fields.size() ? type.fields[number] : kNoField;
  const bool delimited = wire == Wire::kDelimited;
  uint32_t bytes = 0;
  switch (known.kind) {
    case Field::Kind::kScalar:
      if (wire != known.wire) break;
      return skip(wire, &bytes) ? absl::OkStatus() : no_message();
    case Field::Kind::kColumn:
      if (wire != known.wire && !delimited) break;
      return column(known, wire);
    case Field::Kind::kString:
    case Field::Kind::kMessage:
      if (!delimited) break;
      return content(known);
    case Field::Kind::kUnknown:
      break;
  }
  if (number == 0) return no_message();
  return unknown_field(wire);
}

absl::Status WirePlan::Scan::message(const Type& type) {
  while (const uint32_t tag = in.ReadTag()) RETURN_IF_ERROR(field(type, tag));
  return in.ConsumedEntireMessage() ? absl::OkStatus() : no_message();
}

WirePlan::WirePlan(const Descriptor& type, const std::vector<WireLimit>& limits) : root_(&add_type(type, limits)) {}
WirePlan::~WirePlan() = default;
WirePlan::WirePlan(WirePlan&&) noexcept = default;

const WirePlan::Type& WirePlan::add_type(const Descriptor& type, const std::vector<WireLimit>& limits) {
  const auto [known, added] = by_descriptor_.try_emplace(&type, nullptr);
  if (!added) {
    LOCUS_CHECK(known->second != nullptr);  // otherwise the type contains itself
    return *known->second;
  }
  auto plan = std::make_unique<Type>();
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& field = *type.field(i);
    const auto number = static_cast<size_t>(field.number());
    plan->fields.resize(std::max(plan->fields.size(), number + 1));
    plan->fields[number] = make_field(field, limits);
  }
  types_.push_back(std::move(plan));
  by_descriptor_[&type] = types_.back().get();
  return *types_.back();
}

WirePlan::Field WirePlan::make_field(const FieldDescriptor& field, const std::vector<WireLimit>& limits) {
  Field plan;
  plan.wire = wire_of(field);
  plan.value_bytes = bytes_of_value(field);
  if (plan.value_bytes > 0) {
    plan.kind = field.is_repeated() ? Field::Kind::kColumn : Field::Kind::kScalar;
    return plan;
  }
  LOCUS_CHECK(plan.wire == Wire::kDelimited);
  if (field.is_repeated()) {
    const auto row = std::find_if(limits.begin(), limits.end(),
                                  [&](const WireLimit& limit) { return field.full_name() == limit.field; });
    LOCUS_CHECK_EQ(field.full_name(), row == limits.end() ? "a field with a row in the limits" : row->field);
    plan.limit = &*row;
    plan.limit_index = static_cast<uint32_t>(row - limits.begin());
  }
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_STRING) {
    plan.kind = Field::Kind::kString;
    plan.overhead = static_cast<uint32_t>(kStringBytes + (field.is_repeated() ? kGrowth * kPointerBytes : 0));
    return plan;
  }
  plan.kind = Field::Kind::kMessage;
  const Message& object = *MessageFactory::generated_factory()->GetPrototype(field.message_type());
  plan.overhead =
      static_cast<uint32_t>(object.SpaceUsedLong() + kGrowth * kPointerBytes + (field.is_map() ? kMapNodeBytes : 0));
  plan.type = &add_type(*field.message_type(), limits);
  return plan;
}

absl::StatusOr<uint64_t> WirePlan::scan(const grpc::ByteBuffer& bytes) const {
  grpc::ByteBuffer borrowed(bytes);  // shares the slices; the reader needs a pointer to a non-const buffer
  grpc::ProtoBufferReader reader(&borrowed);
  if (!reader.status().ok()) return no_message();
  CodedInputStream in(&reader);
  // No sub-message may end after this position.
  in.PushLimit(static_cast<int>(std::min<size_t>(bytes.Length(), INT32_MAX)));
  Scan scan{in, 0, 0, 0, {}};
  RETURN_IF_ERROR(scan.message(*root_));
  return scan.memory;
}

}  // namespace locus::server
