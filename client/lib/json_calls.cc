#include "client/lib/json_calls.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <google/protobuf/util/json_util.h>

#include <memory>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "grpc/health/v1/health.pb.h"
#include "locus/rpc_paths.h"

namespace locus::client {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;

// Returns null if this program does not know the method.
const MethodDescriptor* descriptor_of(const std::string& service_name, const std::string& name) {
  // The linker keeps the types of a proto file only if the program refers to one of them.
  grpc::health::v1::HealthCheckRequest::descriptor();
  const auto* const service = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(service_name);
  return service == nullptr ? nullptr : service->FindMethodByName(name);
}

std::unique_ptr<Message> new_message(const google::protobuf::Descriptor* type) {
  return std::unique_ptr<Message>(google::protobuf::MessageFactory::generated_factory()->GetPrototype(type)->New());
}

// Returns the scene that a request names, or "".
std::string scene_of(const Message& request) {
  const FieldDescriptor* const field = request.GetDescriptor()->FindFieldByName("scene");
  if (field == nullptr || field->cpp_type() != FieldDescriptor::CPPTYPE_STRING || field->is_repeated()) return "";
  return request.GetReflection()->GetString(request, field);
}

}  // namespace

std::vector<MethodInfo> all_methods() {
  std::vector<MethodInfo> methods;
  for (const std::string_view path : kRpcPaths) {
    const size_t slash = path.rfind('/');
    const MethodDescriptor* const method =
        descriptor_of(std::string(path.substr(1, slash - 1)), std::string(path.substr(slash + 1)));
    if (method == nullptr) continue;
    methods.push_back({.service = method->service()->full_name(),
                       .name = method->name(),
                       .request = method->input_type()->name(),
                       .reply = method->output_type()->name(),
                       .unary = !method->client_streaming() && !method->server_streaming()});
  }
  return methods;
}

absl::StatusOr<std::string> call_json(const Client& client, const MethodInfo& method, absl::string_view json) {
  const MethodDescriptor* const descriptor = descriptor_of(method.service, method.name);
  if (descriptor == nullptr || !method.unary)
    return absl::InvalidArgumentError(absl::StrCat(method.full_name(), " is no unary method"));
  const std::unique_ptr<Message> request = new_message(descriptor->input_type());
  const auto parsed = google::protobuf::util::JsonStringToMessage(std::string(json), request.get());
  if (!parsed.ok())
    return absl::InvalidArgumentError(
        absl::StrCat("the request is no ", method.request, " in JSON: ", std::string(parsed.message())));
  ASSIGN_OR_RETURN(const std::string bytes, client.call_by_path(absl::StrCat("/", method.full_name()),
                                                                request->SerializeAsString(), scene_of(*request)));
  const std::unique_ptr<Message> reply = new_message(descriptor->output_type());
  std::string text;
  if (!reply->ParseFromString(bytes) || !google::protobuf::util::MessageToJsonString(*reply, &text).ok())
    return absl::DataLossError(absl::StrCat("the reply is no ", method.reply));
  return text;
}

}  // namespace locus::client
