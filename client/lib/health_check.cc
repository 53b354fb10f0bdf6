#include "client/lib/health_check.h"

#include <string>

#include "client/lib/status.h"
#include "google/protobuf/empty.pb.h"
#include "google/protobuf/unknown_field_set.h"
#include "grpcpp/client_context.h"
#include "grpcpp/completion_queue.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/impl/codegen/proto_utils.h"

namespace locus::client {
namespace {

// Any message is an Empty with unknown fields.
using google::protobuf::Empty;

constexpr int kServiceField = 1;  // HealthCheckRequest.service, string
constexpr int kStatusField = 1;   // HealthCheckResponse.status, enum

Health health_of(const Empty& response) {
  Health health = Health::kUnknown;
  const google::protobuf::UnknownFieldSet& fields = Empty::GetReflection()->GetUnknownFields(response);
  for (int i = 0; i < fields.field_count(); ++i) {
    const google::protobuf::UnknownField& field = fields.field(i);
    if (field.number() != kStatusField || field.type() != google::protobuf::UnknownField::TYPE_VARINT) continue;
    const uint64_t value = field.varint();
    health = value <= static_cast<uint64_t>(Health::kServiceUnknown) ? static_cast<Health>(value) : Health::kUnknown;
  }
  return health;
}

}  // namespace

absl::StatusOr<Health> check_health(const std::shared_ptr<grpc::ChannelInterface>& channel, absl::string_view service,
                                    absl::Time deadline) {
  Empty request;
  if (!service.empty()) {
    *Empty::GetReflection()->MutableUnknownFields(&request)->AddLengthDelimited(kServiceField) = std::string(service);
  }
  grpc::ClientContext context;
  context.set_deadline(absl::ToChronoTime(deadline));
  grpc::CompletionQueue queue;
  grpc::TemplatedGenericStub<Empty, Empty> stub(channel);
  const auto call = stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", request, &queue);
  Empty response;
  grpc::Status status;
  call->StartCall();
  call->Finish(&response, &status, /*tag=*/nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  queue.Shutdown();
  while (queue.Next(&tag, &ok)) {
  }
  if (!status.ok()) return to_absl_status(status);
  return health_of(response);
}

}  // namespace locus::client
