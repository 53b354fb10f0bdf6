// A gRPC call that sends bytes instead of a message: for requests that none of the project's clients would send.
#ifndef LOCUS_TESTS_SUPPORT_RAW_CALL_H_
#define LOCUS_TESTS_SUPPORT_RAW_CALL_H_

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/support/byte_buffer.h>

#include <memory>
#include <string>

#include "tests/support/running_server.h"

namespace locus::test {

struct RawReply {
  grpc::Status status;
  std::string bytes;
};

// Sends exactly one message to `method`, which may be a streaming method, and reads at most one reply. `token`, if not
// empty, is sent as a bearer token.
inline RawReply raw_call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                         const std::string& bytes, std::chrono::milliseconds timeout = kCallTimeout,
                         const std::string& token = "") {
  grpc::ClientContext context;
  set_timeout(context, timeout);
  if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
  grpc::CompletionQueue queue;
  grpc::GenericStub stub(channel);
  const grpc::Slice slice(bytes);
  const grpc::ByteBuffer request(&slice, 1);
  const auto call = stub.PrepareUnaryCall(&context, method, request, &queue);
  grpc::ByteBuffer response;
  RawReply reply;
  call->StartCall();
  call->Finish(&response, &reply.status, &reply);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  std::vector<grpc::Slice> slices;
  if (response.Valid() && response.Dump(&slices).ok())
    for (const grpc::Slice& part : slices) reply.bytes.append(reinterpret_cast<const char*>(part.begin()), part.size());
  queue.Shutdown();
  while (queue.Next(&tag, &ok)) {
  }
  return reply;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_RAW_CALL_H_
