#include "tests/bench/serving/guests.h"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>

#include "tests/bench/serving/local_server.h"

namespace locus::bench::serving {
namespace {

constexpr std::chrono::milliseconds kStuck{300};
constexpr size_t kComingAtOnce = 8;

}  // namespace

void allow_many_files() {
  rlimit limit;
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

BulkCaller::BulkCaller(const std::string& address, size_t window, v1::StreamQueriesRequest message)
    : window_(window), message_(std::move(message)) {
  const auto stub = std::shared_ptr(v1::QueryService::NewStub(connection_to(address)));
  stream_ = std::make_unique<Load>([stub](grpc::ClientContext* context, grpc::CompletionQueue* queue, void* tag) {
    return stub->AsyncStreamQueries(context, queue, tag);
  });
}

void BulkCaller::run() {
  size_t left = 64;
  const auto next = [&](uint64_t&) { return left-- == 0 ? nullptr : &message_; };
  const auto reply = [&](uint64_t, const v1::StreamQueriesResponse& response, double) {
    if (!response.has_result()) status_.Update(absl::DataLossError("a batch was refused"));
  };
  status_.Update(stream_->run(window_, next, reply));
}

struct SilentReaders::Guest {
  std::unique_ptr<v1::QueryService::Stub> stub;
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientAsyncReaderWriter<v1::StreamQueriesRequest, v1::StreamQueriesResponse>> stream;
};

SilentReaders::SilentReaders(const std::string& address, size_t count, const v1::StreamQueriesRequest& message)
    : message_(message) {
  for (size_t i = 0; i < count; ++i) {
    Guest& guest = *guests_.emplace_back(std::make_unique<Guest>());
    guest.stub = v1::QueryService::NewStub(connection_to(address));
    guest.stream = guest.stub->AsyncStreamQueries(&guest.context, &queue_, &guest);
  }
}

SilentReaders::~SilentReaders() {
  for (const auto& guest : guests_) guest->context.TryCancel();
  queue_.Shutdown();
  void* ignored = nullptr;
  bool ok = false;
  while (queue_.Next(&ignored, &ok)) {
  }
}

void SilentReaders::write_until_stuck() {
  void* tag = nullptr;
  bool ok = false;
  while (queue_.AsyncNext(&tag, &ok, std::chrono::system_clock::now() + kStuck) == grpc::CompletionQueue::GOT_EVENT) {
    Guest& guest = *static_cast<Guest*>(tag);
    if (!ok) continue;
    guest.stream->Write(message_, &guest);
  }
}

// A client that connects, sends one query and leaves. It has at most one pending operation, and none in the step
// kStays.
struct Churn::Guest {
  enum class Step : uint8_t { kCalls, kAsks, kIsAnswered, kStays, kSaysGoodbye, kGoes };

  std::unique_ptr<v1::QueryService::Stub> stub;
  grpc::ClientContext context;
  std::unique_ptr<grpc::ClientAsyncReaderWriter<v1::StreamQueriesRequest, v1::StreamQueriesResponse>> stream;
  v1::StreamQueriesResponse response;
  grpc::Status status;
  Step step = Step::kCalls;
  bool orderly = false;
};

Churn::Churn(const std::string& address, size_t at_once, const v1::StreamQueriesRequest& message)
    : address_(address), at_once_(at_once), message_(message) {}

Churn::~Churn() {
  for (const auto& guest : guests_) guest->context.TryCancel();
  queue_.Shutdown();
  void* ignored = nullptr;
  bool ok = false;
  while (queue_.Next(&ignored, &ok)) {
  }
}

void Churn::run(size_t guests) {
  came_ = 0;
  while (status_.ok() && (came_ < guests || !guests_.empty())) {
    while (came_ < guests && invite()) {
    }
    const bool full = staying_ + coming_ >= at_once_;
    if (staying_ > 0 && (full || (came_ == guests && coming_ == 0))) {
      const auto oldest = std::find_if(guests_.begin(), guests_.end(),
                                       [](const auto& guest) { return guest->step == Guest::Step::kStays; });
      send_away(**oldest);
    }
    if (!next_event()) status_ = absl::DeadlineExceededError("the server keeps silent");
  }
}

bool Churn::invite() {
  if (coming_ == kComingAtOnce || staying_ + coming_ >= at_once_) return false;
  Guest& guest = *guests_.emplace_back(std::make_unique<Guest>());
  guest.orderly = came_ % 2 == 0;
  guest.stub = v1::QueryService::NewStub(connection_to(address_));
  guest.stream = guest.stub->AsyncStreamQueries(&guest.context, &queue_, &guest);
  ++came_;
  ++coming_;
  return true;
}

bool Churn::next_event() {
  void* tag = nullptr;
  bool ok = false;
  const auto deadline = std::chrono::system_clock::now() + kSilence;
  if (queue_.AsyncNext(&tag, &ok, deadline) != grpc::CompletionQueue::GOT_EVENT) return false;
  go_on(*static_cast<Guest*>(tag), ok);
  return true;
}

void Churn::go_on(Guest& guest, bool ok) {
  using Step = Guest::Step;
  switch (guest.step) {
    case Step::kCalls:
      guest.step = Step::kAsks;
      return guest.stream->Write(message_, &guest);
    case Step::kAsks:
      guest.step = Step::kIsAnswered;
      return guest.stream->Read(&guest.response, &guest);
    case Step::kIsAnswered:
      if (!ok || !guest.response.has_result()) status_.Update(absl::DataLossError("a guest was not answered"));
      guest.step = Step::kStays;
      --coming_;
      ++staying_;
      return;
    case Step::kStays:
      return;
    case Step::kSaysGoodbye:
      guest.step = Step::kGoes;
      return guest.stream->Finish(&guest.status, &guest);
    case Step::kGoes:
      if (guest.status.ok() != guest.orderly) status_.Update(absl::DataLossError("a guest's call ended otherwise"));
      return forget(guest);
  }
}

void Churn::send_away(Guest& guest) {
  --staying_;
  guest.step = guest.orderly ? Guest::Step::kSaysGoodbye : Guest::Step::kGoes;
  if (guest.orderly) return guest.stream->WritesDone(&guest);
  guest.context.TryCancel();
  guest.stream->Finish(&guest.status, &guest);
}

void Churn::forget(Guest& guest) {
  guests_.erase(std::find_if(guests_.begin(), guests_.end(), [&](const auto& entry) { return entry.get() == &guest; }));
}

}  // namespace locus::bench::serving
