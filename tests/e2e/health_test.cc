// Watchers of the standard health service: which states they receive, and when.
#include <gtest/gtest.h>

#include <future>

#include "grpc/health/v1/health.grpc.pb.h"
#include "server/config/observability_limits.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using grpc::health::v1::HealthCheckRequest;
using grpc::health::v1::HealthCheckResponse;

// Values of HealthCheckResponse.status.
enum Health : uint64_t { kNothing = 0, kServing = 1, kNotServing = 2, kServiceUnknown = 3 };

class Watcher {
 public:
  Watcher(const std::shared_ptr<grpc::Channel>& channel, const std::string& service)
      : stub_(grpc::health::v1::Health::NewStub(channel)) {
    HealthCheckRequest request;
    request.set_service(service);
    set_timeout(context_);
    reader_ = stub_->Watch(&context_, request);
  }

  // Returns the next state that the watcher receives; kNothing at the end of the stream.
  uint64_t next() {
    HealthCheckResponse response;
    return reader_->Read(&response) ? static_cast<uint64_t>(response.status()) : kNothing;
  }
  grpc::Status end() { return reader_->Finish(); }
  void cancel() { context_.TryCancel(); }

 private:
  grpc::ClientContext context_;
  const std::unique_ptr<grpc::health::v1::Health::Stub> stub_;
  std::unique_ptr<grpc::ClientReader<HealthCheckResponse>> reader_;
};

TEST(HealthTest, AWatcherIsNotifiedAtOnceAndWhenTheServerDrains) {
  RunningServer running;
  Watcher watcher(running.stubs().channel, "");
  EXPECT_EQ(watcher.next(), kServing);
  Watcher of_one(running.stubs().channel, "locus.v1.QueryService");
  EXPECT_EQ(of_one.next(), kServing);
  const auto drained = std::async(std::launch::async, [&] { running.server().drain(std::chrono::seconds(5)); });
  EXPECT_EQ(watcher.next(), kNotServing);
  EXPECT_EQ(watcher.next(), kNothing);
  EXPECT_EQ(watcher.end().error_code(), grpc::StatusCode::UNAVAILABLE);
}

TEST(HealthTest, AnUnknownServiceIsReportedAsUnknown) {
  RunningServer running;
  Watcher watcher(running.stubs().channel, "no.such.Service");
  EXPECT_EQ(watcher.next(), kServiceUnknown);
  watcher.cancel();
  EXPECT_EQ(watcher.end().error_code(), grpc::StatusCode::CANCELLED);
}

TEST(HealthTest, WatchersBeyondTheMaximumAreRefusedUntilOneEnds) {
  RunningServer running;
  std::vector<std::unique_ptr<Watcher>> watchers;
  for (uint32_t i = 0; i < server::kMaxHealthWatchers; ++i) {
    watchers.push_back(std::make_unique<Watcher>(running.stubs().channel, ""));
    EXPECT_EQ(watchers.back()->next(), kServing);
  }
  Watcher refused(running.stubs().channel, "");
  EXPECT_EQ(refused.next(), kNothing);
  const v1::Error error = error_of(refused.end());
  EXPECT_EQ(error.limit(), "health_watchers");
  watchers.back()->cancel();
  EXPECT_FALSE(watchers.back()->end().ok());
  // The watcher's thread notices the cancellation within 100 ms.
  uint64_t told = kNothing;
  for (int tries = 0; told == kNothing && tries < 600; ++tries) {
    Watcher next(running.stubs().channel, "");
    told = next.next();
    next.cancel();
    next.end();
    if (told == kNothing) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  EXPECT_EQ(told, kServing);
}

}  // namespace
}  // namespace locus::test
