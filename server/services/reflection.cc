#include "server/services/reflection.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <array>
#include <set>
#include <string>
#include <vector>

#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "grpc/reflection/v1alpha/reflection.pb.h"
#include "server/config/observability_limits.h"

namespace locus::server {
namespace {

using google::protobuf::DescriptorPool;
using google::protobuf::FileDescriptor;
using ReflectionRequest = grpc::reflection::v1alpha::ServerReflectionRequest;
using ReflectionResponse = grpc::reflection::v1alpha::ServerReflectionResponse;

constexpr std::array kReflectedServices = {"grpc.health.v1.Health",  "grpc.reflection.v1alpha.ServerReflection",
                                           "locus.v1.QueryService",  "locus.v1.SceneService",
                                           "locus.v1.ServerService", "locus.v1.UpdateService"};

// Maximum memory in bytes of a response: the largest file as a message, all files as bytes, and the response's own
// bytes.
constexpr uint64_t kReplyBytes = 256u << 10;

// Adds `file` and all files that it imports, each once.
void add_files(const FileDescriptor& file, ReflectionResponse& response) {
  std::vector<const FileDescriptor*> waiting = {&file};
  std::set<const FileDescriptor*> added = {&file};
  while (!waiting.empty()) {
    const FileDescriptor& next = *waiting.back();
    waiting.pop_back();
    google::protobuf::FileDescriptorProto described;
    next.CopyTo(&described);
    response.mutable_file_descriptor_response()->add_file_descriptor_proto(described.SerializeAsString());
    for (int i = 0; i < next.dependency_count(); ++i)
      if (added.insert(next.dependency(i)).second) waiting.push_back(next.dependency(i));
  }
}

void answer_file(const FileDescriptor* file, const std::string& name, ReflectionResponse& response) {
  if (file != nullptr) return add_files(*file, response);
  response.mutable_error_response()->set_error_code(static_cast<int>(absl::StatusCode::kNotFound));
  response.mutable_error_response()->set_error_message("the schema has no " + name);
}

void answer_question(const ReflectionRequest& request, ReflectionResponse& response) {
  const DescriptorPool& pool = *DescriptorPool::generated_pool();
  switch (request.message_request_case()) {
    case ReflectionRequest::kFileByFilename:
      return answer_file(pool.FindFileByName(request.file_by_filename()), request.file_by_filename(), response);
    case ReflectionRequest::kFileContainingSymbol:
      return answer_file(pool.FindFileContainingSymbol(request.file_containing_symbol()),
                         request.file_containing_symbol(), response);
    case ReflectionRequest::kListServices:
      for (const char* service : kReflectedServices)
        response.mutable_list_services_response()->add_service()->set_name(service);
      return;
    case ReflectionRequest::kAllExtensionNumbersOfType:
      if (pool.FindMessageTypeByName(request.all_extension_numbers_of_type()) == nullptr)
        return answer_file(nullptr, request.all_extension_numbers_of_type(), response);
      // No message of this schema has extensions.
      response.mutable_all_extension_numbers_response()->set_base_type_name(request.all_extension_numbers_of_type());
      return;
    case ReflectionRequest::kFileContainingExtension:
    case ReflectionRequest::MESSAGE_REQUEST_NOT_SET:
      return answer_file(nullptr, "such extension", response);
  }
}

// Refuses a long request before its name is looked up and before the response repeats it. A lookup in the descriptor
// pool tries each prefix of the name that ends before a dot. This takes time quadratic in the length, under a lock that
// all threads share. Unknown fields count too, because the response repeats them.
absl::Status check_length(const ReflectionRequest& request) {
  const size_t bytes = request.ByteSizeLong();
  if (bytes <= kMaxReflectionRequestBytes) return absl::OkStatus();
  return refuse_limit("", "reflection_request_bytes", kMaxReflectionRequestBytes, static_cast<double>(bytes));
}

absl::Status reflect(MessageStream& stream) {
  ReflectionRequest request;
  while (true) {
    ASSIGN_OR_RETURN(const bool got, stream.read(request));
    if (!got) return absl::OkStatus();
    RETURN_IF_ERROR(check_length(request));
    ReflectionResponse response;
    response.set_valid_host(request.host());
    *response.mutable_original_request() = request;
    answer_question(request, response);
    if (!stream.write(response)) return absl::CancelledError("the caller is gone");
  }
}

}  // namespace

BlockingMethod reflection_method(Host& host) {
  BlockingMethod method;
  method.path = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";
  method.limiter = &host.reflections;
  method.limit = "reflections";
  method.reply_bytes = kReplyBytes;
  method.while_closed = WhileClosed::kServe;
  method.body = [](const Caller&, MessageStream& stream) { return reflect(stream); };
  return method;
}

}  // namespace locus::server
