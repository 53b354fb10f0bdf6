// Tests that clients reach a server again soon after it has restarted. The server is a process of its own: the threads
// of a server in this process would continue the client's attempts to connect.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <future>
#include <memory>
#include <string>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "client/lib/client.h"
#include "tests/support/daemon_process.h"
#include "tests/support/temporary_folder.h"

namespace locus::test {
namespace {

class ReconnectTest : public ::testing::Test {
 protected:
  void SetUp() override {
    start();
    client::ClientOptions options;
    options.connect_timeout = absl::Minutes(1);
    absl::StatusOr<std::unique_ptr<client::Client>> client = client::Client::connect(address_, options);
    ASSERT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
  }

  // Starts a daemon and waits until it serves. The client uses the daemon's unix socket, because the port of a killed
  // daemon could be taken by another process.
  void start() {
    std::remove(folder_.file("port").c_str());
    daemon_ = std::make_unique<DaemonProcess>(
        std::vector<std::string>{"--listen", address_, "--listen", "127.0.0.1:0", "--http-listen", "", "--port-file",
                                 folder_.file("port")},
        folder_.file("log"));
    DaemonProcess::wait_for_port(folder_.file("port"));
  }
  void kill() {
    daemon_->signal(SIGKILL);
    daemon_->wait();
  }
  // Makes a call that is never retried.
  absl::Status call() { return client_->delete_scene(request_); }

  TemporaryFolder folder_;
  const std::string address_ = "unix:" + folder_.file("socket");
  std::unique_ptr<DaemonProcess> daemon_;
  std::unique_ptr<client::Client> client_;
  v1::DeleteSceneRequest request_ = [] {
    v1::DeleteSceneRequest request;
    request.set_name("arena");
    return request;
  }();
};

// Returns the number of calls, 50 ms apart, until one is answered; at most `limit`.
template <class Call>
int calls_until_answered(int limit, const Call& call) {
  int calls = 1;
  while (calls < limit && absl::IsUnavailable(call())) {
    absl::SleepFor(absl::Milliseconds(50));
    ++calls;
  }
  return calls;
}

// gRPC pauses for at most 2 s between two attempts to connect. If the client library did not wait inside gRPC before its
// calls (see continue_connecting()), calls would fail for 10 to 15 s.
TEST_F(ReconnectTest, CallsSucceedSoonAfterTheServerHasReturned) {
  EXPECT_TRUE(absl::IsNotFound(call()));
  kill();
  EXPECT_TRUE(absl::IsUnavailable(call()));
  absl::SleepFor(absl::Milliseconds(300));
  EXPECT_TRUE(absl::IsUnavailable(call()));
  start();
  EXPECT_LT(calls_until_answered(100, [this] { return call(); }), 60);
}

TEST_F(ReconnectTest, ACallThatIsRetriedReachesTheServerThatHasReturned) {
  kill();
  EXPECT_TRUE(absl::IsUnavailable(call()));
  std::future<absl::Status> asked = std::async(std::launch::async, [this] { return client_->get_server().status(); });
  start();
  const absl::Status answered = asked.get();
  EXPECT_TRUE(answered.ok()) << answered;
}

}  // namespace
}  // namespace locus::test
