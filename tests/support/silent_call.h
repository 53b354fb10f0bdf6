// A client's call that sends its headers, and nothing more until the test calls send().
#ifndef LOCUS_TESTS_SUPPORT_SILENT_CALL_H_
#define LOCUS_TESTS_SUPPORT_SILENT_CALL_H_

#include <grpcpp/generic/generic_stub.h>

#include <memory>
#include <string>

#include "tests/support/running_server.h"

namespace locus::test {

class SilentCall {
 public:
  // Sends the headers of a call of `method`.
  SilentCall(const std::shared_ptr<grpc::Channel>& channel, const std::string& method) : stub_(channel) {
    set_timeout(context_);
    call_ = stub_.PrepareCall(&context_, method, &queue_);
    call_->StartCall(this);
    wait();
  }
  ~SilentCall() {
    context_.TryCancel();
    queue_.Shutdown();
    void* tag = nullptr;
    bool ok = false;
    while (queue_.Next(&tag, &ok)) {
    }
  }

  // Sends an empty message, the only one of the call.
  void send() {
    const grpc::Slice nothing("");
    call_->WriteLast(grpc::ByteBuffer(&nothing, 1), grpc::WriteOptions(), this);
    wait();
  }
  // Reads the answer, if there is one, and waits for the end of the call.
  grpc::Status finish() {
    grpc::ByteBuffer answer;
    call_->Read(&answer, this);
    wait();
    grpc::Status status;
    call_->Finish(&status, this);
    wait();
    return status;
  }

 private:
  void wait() {
    void* tag = nullptr;
    bool ok = false;
    queue_.Next(&tag, &ok);
  }

  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  grpc::GenericStub stub_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SILENT_CALL_H_
