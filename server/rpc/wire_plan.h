// Scan of a message's bytes before Protobuf parses them. Parsing can turn two bytes into an object of a hundred bytes
// or more, so a small message could otherwise use any amount of memory. The scan refuses bytes that are no message,
// counts repeated sub-messages against their limits, and returns an upper bound of the parsed message's memory.
//
// A WirePlan is built from the message's descriptor, once for each type. It is immutable; any thread may use it.
// Cost of a scan: about 10 ns for each field; packed columns are skipped, not read.
#ifndef LOCUS_SERVER_RPC_WIRE_PLAN_H_
#define LOCUS_SERVER_RPC_WIRE_PLAN_H_

#include <google/protobuf/descriptor.h>
#include <grpcpp/support/byte_buffer.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"

namespace google::protobuf::io {
class CodedInputStream;
}

namespace locus::server {

// Maximum number of values that a repeated field of sub-messages or strings, or a map, may have in one message.
struct WireLimit {
  const char* field;  // full name of the field, such as "locus.v1.SceneSpec.labels"
  const char* path;   // name of the field in a refusal, such as "spec.labels"
  const char* limit;  // name of the limit in a refusal
  uint32_t max;
};

// Maximum number of fields in the bytes of a message, those of its sub-messages included. A packed column, as
// Protobuf's libraries write it, counts as one field. In a column that is not packed, each value counts.
inline constexpr uint32_t kMaxWireFields = 1u << 20;
// Maximum number of fields of a message that are not in this build's schema. Clients of a later version may send some.
inline constexpr uint32_t kMaxUnknownFields = 256;

class WirePlan {
 public:
  // Builds the plan of `type`. Every repeated sub-message, repeated string and map in `type` must have a row in
  // `limits`. Precondition: neither `type` nor a message type inside it contains itself.
  WirePlan(const google::protobuf::Descriptor& type, const std::vector<WireLimit>& limits);
  ~WirePlan();
  WirePlan(WirePlan&&) noexcept;

  // Returns an upper bound in bytes of the memory of the parsed message. Returns INVALID_ARGUMENT (MALFORMED) if the
  // bytes are no message of this type, and INVALID_ARGUMENT (LIMIT), naming the field and the limit, if a field has too
  // many values.
  absl::StatusOr<uint64_t> scan(const grpc::ByteBuffer& bytes) const;

 private:
  struct Field;
  struct Type;
  struct Scan;

  const Type& add_type(const google::protobuf::Descriptor& type, const std::vector<WireLimit>& limits);
  Field make_field(const google::protobuf::FieldDescriptor& field, const std::vector<WireLimit>& limits);

  std::vector<std::unique_ptr<Type>> types_;
  absl::flat_hash_map<const google::protobuf::Descriptor*, const Type*> by_descriptor_;
  const Type* root_ = nullptr;
};

// Returns the limits of the fields of all requests that this server receives.
const std::vector<WireLimit>& request_limits();

// Returns the plan of a request type, which is built at the first call.
template <class Request>
const WirePlan& wire_plan() {
  static const WirePlan* const kPlan = new WirePlan(*Request::descriptor(), request_limits());
  return *kPlan;
}

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_WIRE_PLAN_H_
