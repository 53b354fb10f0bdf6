// Calls a unary method of locus.v1 with a JSON request and prints the JSON answer. It replaces grpcurl, which Debian
// does not package, so that a test can run the example call of the README.
//
//   json_call ADDRESS locus.v1.Service/Method JSON
#include <google/protobuf/descriptor.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/util/json_util.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/security/credentials.h>

#include <iostream>
#include <memory>
#include <string>

#include "locus/v1/query_service.pb.h"
#include "locus/v1/scene_service.pb.h"
#include "locus/v1/server_service.pb.h"
#include "locus/v1/update_service.pb.h"

namespace {

using google::protobuf::Message;

int fail(const std::string& why) {
  std::cerr << "json_call: " << why << "\n";
  return 1;
}

std::string bytes_of(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  std::string bytes;
  if (!buffer.Dump(&slices).ok()) return bytes;
  for (const grpc::Slice& slice : slices) bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return bytes;
}

grpc::Status call(const std::string& address, const std::string& path, const Message& request, Message& reply) {
  grpc::GenericStub stub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(10));
  const grpc::Slice slice(request.SerializeAsString());
  const grpc::ByteBuffer out(&slice, 1);
  grpc::CompletionQueue queue;
  const auto reader = stub.PrepareUnaryCall(&context, path, out, &queue);
  reader->StartCall();
  grpc::ByteBuffer in;
  grpc::Status status;
  reader->Finish(&in, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  if (status.ok() && !reply.ParseFromString(bytes_of(in)))
    return {grpc::StatusCode::DATA_LOSS, "the answer is no message of its type"};
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return fail("give ADDRESS, SERVICE/METHOD and JSON");
  const std::string target = argv[2];
  const size_t slash = target.find('/');
  // References one message of each proto file, so that the linker keeps all proto files in the pool of generated types.
  for (const Message* linked : std::initializer_list<const Message*>{
           &locus::v1::QueryRequest::default_instance(), &locus::v1::GetSceneRequest::default_instance(),
           &locus::v1::GetServerRequest::default_instance(), &locus::v1::ApplyUpdatesRequest::default_instance()})
    if (linked->GetDescriptor() == nullptr) return fail("the protocol is not linked");
  const auto* service = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(target.substr(0, slash));
  const auto* method =
      service == nullptr || slash == std::string::npos ? nullptr : service->FindMethodByName(target.substr(slash + 1));
  if (method == nullptr) return fail("there is no method " + target);
  google::protobuf::DynamicMessageFactory factory;
  const std::unique_ptr<Message> request(factory.GetPrototype(method->input_type())->New());
  const std::unique_ptr<Message> reply(factory.GetPrototype(method->output_type())->New());
  if (const auto parsed = google::protobuf::util::JsonStringToMessage(argv[3], request.get()); !parsed.ok())
    return fail(parsed.ToString());
  const grpc::Status status = call(argv[1], "/" + target, *request, *reply);
  if (!status.ok()) return fail(status.error_message());
  std::string json;
  if (!google::protobuf::util::MessageToJsonString(*reply, &json).ok()) return fail("the answer has no JSON form");
  std::cout << json << "\n";
  return 0;
}
