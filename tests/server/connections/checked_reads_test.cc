#include "server/connections/checked_reads.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/connections/frame_check.h"
#include "tests/support/raw_socket.h"

namespace locus::server {
namespace {

using test::http2_frame;
using test::kHttp2Opening;

const std::string kTooLong = kHttp2Opening + http2_frame(1, 0, 1, std::string(FrameCheck::kMaxBlockBytes + 1, 'h'));

// Returns whether CheckedReads accepts `bytes`, which were read into two buffers; the first buffer has `first` bytes.
bool accepted(int descriptor, std::string bytes, size_t first = 10) {
  std::array<iovec, 2> buffers{iovec{bytes.data(), first}, iovec{bytes.data() + first, bytes.size() - first}};
  msghdr message{};
  message.msg_iov = buffers.data();
  message.msg_iovlen = buffers.size();
  return CheckedReads::accept(descriptor, message, bytes.size());
}

// Two connected sockets.
struct Pair {
  Pair() { EXPECT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()), 0); }
  ~Pair() {
    for (const int end : ends) close(end);
  }
  std::array<int, 2> ends{};
};

class CheckedReadsTest : public ::testing::Test {
 protected:
  static std::shared_ptr<Connection> connection(int descriptor) {
    return std::make_shared<Connection>(*peer_of(descriptor), std::chrono::steady_clock::now(), -1);
  }

  std::atomic<int> refused_{0};
  std::optional<CheckedReads> reads_{std::in_place, [this](Connection&, const char*) { refused_.fetch_add(1); }};
};

TEST_F(CheckedReadsTest, AWatchedSocketIsReportedOnceAndItsBytesAreRefused) {
  const Pair pair;
  reads_->watch(pair.ends[0], connection(pair.ends[0]));
  EXPECT_TRUE(accepted(pair.ends[0], kHttp2Opening));
  EXPECT_FALSE(accepted(pair.ends[0], kTooLong.substr(kHttp2Opening.size())));
  EXPECT_EQ(refused_.load(), 1);
}

TEST_F(CheckedReadsTest, OtherDescriptorsAreAccepted) {
  const Pair pair;
  reads_->watch(pair.ends[0], connection(pair.ends[0]));
  EXPECT_TRUE(accepted(pair.ends[1], kTooLong));
  EXPECT_TRUE(accepted(-1, kTooLong));
  EXPECT_EQ(refused_.load(), 0);
}

TEST_F(CheckedReadsTest, OnlyTheBytesThatWereReadAreChecked) {
  const Pair pair;
  reads_->watch(pair.ends[0], connection(pair.ends[0]));
  std::string bytes = kTooLong;
  iovec buffer{bytes.data(), bytes.size()};
  msghdr message{};
  message.msg_iov = &buffer;
  message.msg_iovlen = 1;
  EXPECT_TRUE(CheckedReads::accept(pair.ends[0], message, kHttp2Opening.size() + 8));
  EXPECT_FALSE(accepted(pair.ends[0], bytes.substr(kHttp2Opening.size() + 8)));
}

TEST_F(CheckedReadsTest, ADescriptorThatIsUsedAgainIsNotChecked) {
  const Pair first, second;
  reads_->watch(first.ends[0], connection(first.ends[0]));
  ASSERT_EQ(dup2(second.ends[0], first.ends[0]), first.ends[0]);
  EXPECT_TRUE(accepted(first.ends[0], kTooLong));
  EXPECT_EQ(refused_.load(), 0);
}

TEST_F(CheckedReadsTest, ASocketThatIsWatchedAgainBeginsWithThePreface) {
  const Pair pair;
  reads_->watch(pair.ends[0], connection(pair.ends[0]));
  EXPECT_TRUE(accepted(pair.ends[0], kTooLong.substr(0, 28)));
  reads_->watch(pair.ends[0], connection(pair.ends[0]));
  EXPECT_TRUE(accepted(pair.ends[0], kHttp2Opening));
  EXPECT_FALSE(accepted(pair.ends[0], kTooLong.substr(kHttp2Opening.size())));
}

TEST_F(CheckedReadsTest, NothingIsCheckedAfterTheEnd) {
  const Pair pair;
  reads_->watch(pair.ends[0], connection(pair.ends[0]));
  reads_.reset();
  EXPECT_TRUE(accepted(pair.ends[0], kTooLong));
  EXPECT_EQ(refused_.load(), 0);
}

// Threads read from sockets of their own while another thread begins and ends checks of further sockets.
TEST_F(CheckedReadsTest, ThreadsReadWhileSocketsComeAndGo) {
  constexpr int kReaders = 4, kRounds = 2000;
  std::array<Pair, kReaders> pairs;
  for (const Pair& pair : pairs) reads_->watch(pair.ends[0], connection(pair.ends[0]));
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (const Pair& pair : pairs)
    threads.emplace_back([&pair, &wrong] {
      if (!accepted(pair.ends[0], kHttp2Opening)) ++wrong;
      for (int round = 0; round < kRounds; ++round)
        if (!accepted(pair.ends[0], http2_frame(0, 0, 1, "data"), 3)) ++wrong;
      if (accepted(pair.ends[0], kTooLong.substr(kHttp2Opening.size()))) ++wrong;
    });
  threads.emplace_back([this, &wrong] {
    for (int round = 0; round < kRounds / 4; ++round) {
      const Pair pair;
      reads_->watch(pair.ends[0], connection(pair.ends[0]));
      if (!accepted(pair.ends[0], kHttp2Opening)) ++wrong;
    }
  });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong.load(), 0);
  EXPECT_EQ(refused_.load(), kReaders);
}

}  // namespace
}  // namespace locus::server
