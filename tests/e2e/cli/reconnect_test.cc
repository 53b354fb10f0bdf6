// Tests that clients reach a server again soon after it has restarted. The server is a process of its own: the threads
// of a server in this process would continue the client's attempts to connect.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdio>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/time/clock.h"
#include "client/lib/client.h"
#include "tests/support/daemon_process.h"
#include "tests/support/temporary_folder.h"

namespace locus::test {
namespace {

class ReconnectTest : public ::testing::Test {
 protected:
  using Call = std::function<absl::Status()>;

  void SetUp() override {
    start();
    client::ClientOptions options;
    options.connect_timeout = absl::Minutes(1);
    options.retry.max_attempts = 10'000;
    options.deadline = absl::Minutes(1);
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

  // Kills the daemon and starts it again, and verifies that a call that is never retried is answered soon afterwards.
  // gRPC pauses for at most 2 s between two attempts to connect. If the client library did not wait inside gRPC before
  // its calls (see continue_connecting()), calls would fail for 10 to 15 s.
  void expect_an_answer_soon_after_a_restart(const Call& call) {
    EXPECT_TRUE(absl::IsNotFound(call()));
    kill();
    EXPECT_TRUE(absl::IsUnavailable(call()));
    absl::SleepFor(absl::Milliseconds(300));
    EXPECT_TRUE(absl::IsUnavailable(call()));
    start();
    int calls = 1;
    for (; calls < 60 && absl::IsUnavailable(call()); ++calls) absl::SleepFor(absl::Milliseconds(50));
    EXPECT_LT(calls, 60);
    EXPECT_TRUE(absl::IsNotFound(call()));
  }

  TemporaryFolder folder_;
  const std::string address_ = "unix:" + folder_.file("socket");
  std::unique_ptr<DaemonProcess> daemon_;
  std::unique_ptr<client::Client> client_;
};

TEST_F(ReconnectTest, UnaryCallsSucceedSoonAfterTheServerHasReturned) {
  v1::DeleteSceneRequest request;
  request.set_name("arena");
  expect_an_answer_soon_after_a_restart([&] { return client_->delete_scene(request); });
}

TEST_F(ReconnectTest, TransfersSucceedSoonAfterTheServerHasReturned) {
  v1::DumpSceneRequest request;
  request.set_scene("arena");
  expect_an_answer_soon_after_a_restart(
      [&] { return client_->dump(request, [](const v1::DumpSceneResponse&) { return absl::OkStatus(); }); });
}

TEST_F(ReconnectTest, ACallThatIsRetriedReachesTheServerThatHasReturned) {
  kill();
  std::future<absl::Status> asked = std::async(std::launch::async, [this] { return client_->get_server().status(); });
  start();
  const absl::Status answered = asked.get();
  EXPECT_TRUE(answered.ok()) << answered;
}

// The attempts would be used up after 6 s if the stream did not wait inside gRPC before each of them.
TEST_F(ReconnectTest, AStreamReachesTheServerThatHasReturned) {
  client::QueryStreamOptions options;
  options.reconnect = {60, absl::Milliseconds(50), absl::Milliseconds(100)};
  const std::unique_ptr<client::QueryStream> stream = client_->query_stream("arena", options);
  kill();
  absl::Status answer = absl::UnknownError("not answered");
  ASSERT_TRUE(stream->send({}, [&](const absl::StatusOr<v1::QueryResult>& result) { answer = result.status(); }).ok());
  absl::SleepFor(absl::Milliseconds(300));
  start();
  EXPECT_TRUE(stream->flush().ok());
  EXPECT_TRUE(absl::IsNotFound(answer)) << answer;
}

}  // namespace
}  // namespace locus::test
