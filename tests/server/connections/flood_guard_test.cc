#include "server/connections/flood_guard.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/raw_socket.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;

constexpr double kKiB = 1024;
constexpr double kMiB = 1024 * kKiB;

// Rates of a connection per second.
struct Traffic {
  const char* name;
  double bytes = 0;     // bytes received by the kernel
  double segments = 0;  // segments with data
  double calls = 0;     // calls that begin and end, in addition to `open`
  double metadata = 0;  // bytes of metadata of the calls that begin
  double cancelled = 0;
  double messages = 0;
  double message_bytes = 0;
  double written = 0;
  uint64_t open = 0;  // calls that are always open
};

FloodSample sample_at(const Traffic& traffic, milliseconds time) {
  const double seconds = std::chrono::duration<double>(time).count();
  const auto sum = [seconds](double rate) { return static_cast<uint64_t>(rate * seconds); };
  FloodSample sample;
  sample.time = std::chrono::steady_clock::time_point(time);
  sample.received = {sum(traffic.bytes), sum(traffic.segments)};
  sample.counts.calls_begun = sum(traffic.calls) + traffic.open;
  sample.counts.calls_open = traffic.open;
  sample.counts.metadata_bytes = sum(traffic.metadata);
  sample.counts.calls_cancelled = sum(traffic.cancelled);
  sample.counts.messages_read = sum(traffic.messages);
  sample.counts.message_bytes = sum(traffic.message_bytes);
  sample.counts.bytes_written = sum(traffic.written);
  return sample;
}

// Returns the verdict on `seconds` of steady traffic, which is assessed every 100 ms. Ends early with the first verdict
// other than kHonest.
FloodVerdict verdict_of(const Traffic& traffic, int seconds) {
  FloodBudget budget;
  budget.last.time = std::chrono::steady_clock::time_point();
  for (milliseconds time{100}; time <= std::chrono::seconds(seconds); time += milliseconds(100))
    if (const FloodVerdict verdict = assess(sample_at(traffic, time), {}, budget); verdict != FloodVerdict::kHonest)
      return verdict;
  return FloodVerdict::kHonest;
}

TEST(FloodGuardTest, HonestExtremesAreHonest) {
  const std::vector<Traffic> honest = {
      {.name = "nothing"},
      {.name = "100,000 small unary calls",
       .bytes = 1e5 * 180,
       .segments = 1e5,
       .calls = 1e5,
       .messages = 1e5,
       .message_bytes = 1e5 * 40,
       .written = 1e5 * 20,
       .open = 100},
      {.name = "calls with 8 KiB of metadata",
       .bytes = 2e4 * 8.4 * kKiB,
       .segments = 2e5,
       .calls = 2e4,
       .metadata = 2e4 * 8 * kKiB,
       .messages = 2e4,
       .message_bytes = 2e4 * 40},
      {.name = "a stream of 200,000 small messages",
       .bytes = 2e5 * 60,
       .segments = 1e5,
       .messages = 2e5,
       .message_bytes = 2e5 * 20,
       .open = 1},
      {.name = "32 MiB messages over TLS",
       .bytes = 1000 * kMiB * 1.025,
       .segments = 1e5,
       .messages = 31.25,
       .message_bytes = 1000 * kMiB,
       .open = 1},
      {.name = "2,000 idle streams with keepalive pings", .bytes = 17, .segments = 1, .open = 2000},
      {.name = "a reader of 1 GiB a second", .bytes = 1.8 * kMiB, .segments = 4e4, .written = 1024 * kMiB, .open = 4},
      {.name = "900 cancelled calls of 900", .bytes = 900 * 200, .calls = 900, .cancelled = 900},
      {.name = "2,000 cancelled calls of 10,000", .bytes = 1e4 * 200, .calls = 1e4, .cancelled = 2000},
  };
  for (const Traffic& traffic : honest) EXPECT_EQ(verdict_of(traffic, 60), FloodVerdict::kHonest) << traffic.name;
}

TEST(FloodGuardTest, FloodsAreDetected) {
  const std::vector<std::pair<Traffic, FloodVerdict>> hostile = {
      {{.name = "200,000 pings", .bytes = 2e5 * 17, .segments = 2000}, FloodVerdict::kTooManyBytes},
      {{.name = "empty DATA on a stream", .bytes = 3e5 * 9, .segments = 2000, .open = 1}, FloodVerdict::kTooManyBytes},
      {{.name = "CONTINUATION", .bytes = 200 * kMiB, .segments = 1e4}, FloodVerdict::kTooManyBytes},
      {{.name = "single bytes", .bytes = 5e4, .segments = 5e4}, FloodVerdict::kTooManyBytes},
      {{.name = "pings beside calls", .bytes = 2e6 * 17 + 1000 * 200, .segments = 1e4, .calls = 1000},
       FloodVerdict::kTooManyBytes},
      {{.name = "500 pings beside each of many small calls",
        .bytes = 1e4 * (60 + 500 * 17),
        .segments = 1e4,
        .calls = 1e4},
       FloodVerdict::kTooManyBytes},
      {{.name = "rapid reset", .bytes = 1e5 * 60, .segments = 1e4, .calls = 1e5, .cancelled = 1e5},
       FloodVerdict::kTooManyCancelled},
      {{.name = "most calls cancelled", .bytes = 3e3 * 60, .calls = 3000, .cancelled = 1600},
       FloodVerdict::kTooManyCancelled},
  };
  for (const auto& [traffic, verdict] : hostile) EXPECT_EQ(verdict_of(traffic, 60), verdict) << traffic.name;
}

TEST(FloodGuardTest, AMessageMayArriveInFullBeforeItIsRead) {
  FloodBudget budget;
  FloodSample sample;
  sample.counts.calls_begun = sample.counts.calls_open = 8;
  for (int message = 0; message < 20; ++message) {
    sample.time += milliseconds(100);
    sample.received.bytes += static_cast<uint64_t>(8 * 32 * kMiB);  // eight uploads at once
    EXPECT_EQ(assess(sample, {}, budget), FloodVerdict::kHonest) << message;
    sample.time += milliseconds(100);
    sample.counts.messages_read += 8;
    sample.counts.message_bytes += static_cast<uint64_t>(8 * 32 * kMiB);
    EXPECT_EQ(assess(sample, {}, budget), FloodVerdict::kHonest) << message;
    EXPECT_EQ(budget.unexplained, 0);
  }
}

TEST(FloodGuardTest, CallsDoNotJustifyLaterBytes) {
  FloodBudget budget;
  FloodSample sample;
  sample.counts.calls_begun = 1'000'000;  // enough calls to justify 1 GB of frames; no frame arrives
  sample.time += milliseconds(1000);
  EXPECT_EQ(assess(sample, {}, budget), FloodVerdict::kHonest);
  sample.received.bytes += static_cast<uint64_t>(40 * kMiB);
  sample.time += milliseconds(100);
  EXPECT_EQ(assess(sample, {}, budget), FloodVerdict::kTooManyBytes);
}

TEST(FloodGuardTest, AUnaryMessageMayArriveBeforeItsCallIsReported) {
  FloodBudget budget;
  FloodSample sample;
  for (int call = 1; call <= 20; ++call) {
    sample.received.bytes += static_cast<uint64_t>(32 * kMiB);
    sample.time += milliseconds(20);
    EXPECT_EQ(assess(sample, {}, budget), FloodVerdict::kHonest) << call;
    ++sample.counts.calls_begun;
    ++sample.counts.messages_read;
    sample.counts.message_bytes += static_cast<uint64_t>(32 * kMiB);
  }
}

TEST(FloodGuardTest, UnaryMessagesOfAllStreamsMayArriveAtTheSameTime) {
  FloodBudget budget;
  FloodSample sample;
  sample.streams = 2;  // two streams whose calls are not in `counts` yet
  sample.received.bytes = static_cast<uint64_t>(60 * kMiB);
  sample.time += milliseconds(100);
  EXPECT_EQ(assess(sample, {}, budget), FloodVerdict::kHonest);
  sample.streams.reset();  // streams are not counted in this sample, since few bytes have arrived
  sample.time += milliseconds(20);
  EXPECT_EQ(assess(sample, {}, budget), FloodVerdict::kHonest);
  sample.streams = 0;
  sample.time += milliseconds(20);
  EXPECT_EQ(assess(sample, {}, budget), FloodVerdict::kTooManyBytes);
}

TEST(FloodGuardTest, MoreStreamsThanMayBeOpenAreTooMany) {
  FloodLimits limits;
  limits.streams = 100;
  FloodBudget budget;
  FloodSample sample;
  sample.streams = 100;
  EXPECT_EQ(assess(sample, limits, budget), FloodVerdict::kHonest);
  sample.streams = 101;
  EXPECT_EQ(assess(sample, limits, budget), FloodVerdict::kTooManyStreams);
}

// Fixture with a guard. The fixture counts the guard's requests for the number of streams and answers them with a
// constant.
class FloodGuardThreadTest : public ::testing::Test {
 protected:
  void watch(std::optional<uint64_t> streams) {
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM, 0, ends_), 0);
    connection_ = std::make_shared<Connection>(Peer(), std::chrono::steady_clock::now(), ends_[0]);
    guard_ = std::make_unique<FloodGuard>(
        FloodLimits(),
        [this, streams](Connection&) {
          ++counted_;
          return streams;
        },
        [](const Connection&, const char*) {});
    guard_->watch(connection_);
  }
  void TearDown() override {
    guard_->forget(*connection_);
    guard_.reset();
    close(ends_[1]);
  }
  void send() { EXPECT_EQ(write(ends_[1], "x", 1), 1); }

  int ends_[2];
  std::atomic<int> counted_{0};
  std::shared_ptr<Connection> connection_;
  std::unique_ptr<FloodGuard> guard_;
};

TEST_F(FloodGuardThreadTest, AConnectionWithTooManyStreamsIsClosed) {
  watch(1'000'000);
  send();
  EXPECT_TRUE(test::wait_until([&] { return guard_->closed() == 1; }));
  EXPECT_STREQ(connection_->close_reason(), "more streams than it may open, cancelled before they were accepted");
}

TEST_F(FloodGuardThreadTest, AConnectionWithFewOrUnknownStreamsStaysOpen) {
  watch(std::nullopt);
  EXPECT_TRUE(test::wait_until([&] {
    send();
    return counted_ > 3;
  }));
  EXPECT_EQ(connection_->close_reason(), nullptr);
}

TEST(FloodGuardTest, TheKernelsCounterOfSegmentsMayWrap) {
  FloodBudget budget;
  budget.last.received.segments = 0xffff'fff0u;
  FloodSample sample;
  sample.time += milliseconds(100);
  sample.received.segments = 0x10;
  EXPECT_EQ(assess(sample, {}, budget), FloodVerdict::kHonest);
}

}  // namespace
}  // namespace locus::server
