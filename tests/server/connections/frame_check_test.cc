#include "server/connections/frame_check.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>

#include "tests/support/raw_socket.h"

namespace locus::server {
namespace {

using std::chrono::seconds;
using test::http2_frame;
using test::kHttp2Opening;

constexpr uint8_t kData = 0, kHeaders = 1, kPriority = 2, kReset = 3, kSettings = 4, kPing = 6, kGoaway = 7,
                  kWindowUpdate = 8, kContinuation = 9, kUnknown = 0x42;
constexpr uint8_t kEndStream = 1, kEndHeaders = 4;
const std::string kCancel(4, '\x8');

std::string repeated(const std::string& text, size_t times) {
  std::string all;
  for (size_t i = 0; i < times; ++i) all += text;
  return all;
}

// Fixture with the FrameCheck of a connection whose client has sent its opening: the preface and a SETTINGS frame.
class FrameCheckTest : public ::testing::Test {
 protected:
  FrameCheckTest() { EXPECT_TRUE(accepts(kHttp2Opening)); }
  bool accepts(const std::string& bytes) { return check_.refusal(bytes, now_) == nullptr; }

  std::string call() {
    stream_ += 2;
    return http2_frame(kHeaders, kEndHeaders, stream_, "headers") + http2_frame(kData, kEndStream, stream_, "");
  }
  std::string cancel() const { return http2_frame(kReset, 0, stream_, kCancel); }
  std::string cancelled_call() {
    const std::string begin = call();
    return begin + cancel();
  }
  // Returns whether the check accepts `count` calls that are all cancelled, each in a read of its own.
  bool accepts_cancelled(int count) {
    for (int i = 0; i < count; ++i)
      if (!accepts(cancelled_call())) return false;
    return true;
  }

  FrameCheck check_;
  FrameCheck::Time now_{seconds(100)};
  uint32_t stream_ = 99;
};

TEST_F(FrameCheckTest, BlocksUpToTheMaximaAreAccepted) {
  const std::string longest = http2_frame(kHeaders, 0, 1, std::string(FrameCheck::kMaxBlockBytes, 'h'));
  EXPECT_TRUE(accepts(longest));
  EXPECT_TRUE(accepts(longest + http2_frame(kContinuation, kEndHeaders, 1, "")));
  const std::string most =
      http2_frame(kHeaders, 0, 1, "h") + repeated(http2_frame(kContinuation, 0, 1, "h"), FrameCheck::kMaxContinuations);
  EXPECT_TRUE(accepts(repeated(most, 100)));
}

TEST_F(FrameCheckTest, ABlockInOneFrameThatIsTooLongIsRefusedBeforeItHasArrived) {
  const std::string frame = http2_frame(kHeaders, kEndHeaders, 1, std::string(FrameCheck::kMaxBlockBytes + 1, 'h'));
  EXPECT_TRUE(accepts(frame.substr(0, 8)));
  EXPECT_FALSE(accepts(frame.substr(8, 1)));
}

TEST_F(FrameCheckTest, ABlockInSeveralFramesThatIsTooLongIsRefused) {
  const std::string half(FrameCheck::kMaxBlockBytes / 2, 'h');
  EXPECT_FALSE(accepts(http2_frame(kHeaders, 0, 1, half + "h") + http2_frame(kContinuation, 0, 1, half)));
}

TEST_F(FrameCheckTest, ABlockInTooManyFramesIsRefused) {
  EXPECT_FALSE(accepts(http2_frame(kHeaders, 0, 1, "h") +
                       repeated(http2_frame(kContinuation, 0, 1, ""), FrameCheck::kMaxContinuations + 1)));
}

TEST_F(FrameCheckTest, OtherFramesAreSkippedWhateverTheyContain) {
  const std::string inside = http2_frame(kHeaders, 4, 1, std::string(FrameCheck::kMaxBlockBytes + 1, 'h'));
  EXPECT_TRUE(accepts(repeated(http2_frame(kData, 0, 1, inside), 20)));
}

TEST_F(FrameCheckTest, CallsThatAreCancelledAtOnceAreRefusedAfterTwiceTheBurst) {
  EXPECT_TRUE(accepts_cancelled(static_cast<int>(2 * FrameCheck::kBurst) - 1));
  EXPECT_FALSE(accepts_cancelled(1));
}

TEST_F(FrameCheckTest, HeadersThatBeginNoCallDoNotPayForCancelledCalls) {
  int accepted = 0;
  const std::string trailers = http2_frame(kHeaders, kEndHeaders | kEndStream, 1, "");
  const std::string even = http2_frame(kHeaders, kEndHeaders | kEndStream, 2, "");
  while (accepted < 5000 && accepts(cancelled_call() + trailers + even)) ++accepted;
  EXPECT_LT(accepted, 2 * FrameCheck::kBurst);
}

TEST_F(FrameCheckTest, AClientMayCancelEveryOtherCallForEver) {
  for (int round = 0; round < 100'000; ++round) ASSERT_TRUE(accepts(call()) && accepts(cancelled_call()));
}

TEST_F(FrameCheckTest, AClientMayCancelAllCallsAtAModerateRate) {
  for (int round = 0; round < 100; ++round, now_ += seconds(1)) ASSERT_TRUE(accepts_cancelled(1900));
}

TEST_F(FrameCheckTest, ManyOpenCallsMayBeCancelledTogether) {
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(accepts(call()));
  EXPECT_TRUE(accepts(repeated(cancel(), 1000)));
}

TEST_F(FrameCheckTest, AReadWithMoreCallsThanAClientMayOpenIsRefused) {
  std::string calls;
  for (uint32_t i = 0; i < FrameCheck::kMaxCallsOfRead; ++i) calls += call();
  EXPECT_TRUE(accepts(calls));
  calls.clear();
  for (uint32_t i = 0; i <= FrameCheck::kMaxCallsOfRead; ++i) calls += call();
  EXPECT_FALSE(accepts(calls));
}

// grpc-go sends a PING for each reply, to estimate the bandwidth-delay product of the connection.
TEST_F(FrameCheckTest, APingAfterEachReplyIsAccepted) {
  const std::string ping = http2_frame(kPing, 0, 0, "12345678"), update = http2_frame(kWindowUpdate, 0, 0, "1234");
  for (int i = 0; i < 100'000; ++i) ASSERT_TRUE(accepts(call() + ping));
  for (int i = 0; i < 100'000; ++i) ASSERT_TRUE(accepts(update + ping));
}

TEST_F(FrameCheckTest, FloodsOfFramesThatCarryNothingAreRefused) {
  const std::string ping = http2_frame(kPing, 0, 0, "12345678"), empty = http2_frame(kData, 0, 1, "");
  for (const std::string& frame : {ping, empty, http2_frame(kSettings, 0, 0, ""), http2_frame(kPriority, 0, 1, "12345"),
                                   http2_frame(kGoaway, 0, 0, "12345678"), http2_frame(kUnknown, 0, 0, "")}) {
    FrameCheck check;
    const auto most = static_cast<size_t>(FrameCheck::kBurst) - 1;  // the opening contains one frame, SETTINGS
    EXPECT_EQ(check.refusal(kHttp2Opening + repeated(frame, most), now_), nullptr);
    EXPECT_NE(check.refusal(frame + frame, now_), nullptr);
  }
}

TEST_F(FrameCheckTest, EmptyFramesAreAcceptedAtAModerateRate) {
  for (int round = 0; round < 100; ++round, now_ += seconds(1))
    ASSERT_TRUE(accepts(repeated(http2_frame(kPing, 0, 0, "12345678"), 900)));
}

TEST_F(FrameCheckTest, WindowUpdatesDataAndEndsOfStreamsAreNotCounted) {
  EXPECT_TRUE(accepts(repeated(http2_frame(kWindowUpdate, 0, 1, "1234"), 100'000)));
  EXPECT_TRUE(accepts(repeated(http2_frame(kData, 0, 1, "1"), 100'000)));
  EXPECT_TRUE(accepts(repeated(http2_frame(kData, kEndStream, 1, ""), 100'000)));
}

// Returns a random sequence of frames after the client's opening. The check refuses about half of such sequences.
std::string random_frames(std::mt19937_64& random) {
  constexpr std::array<uint8_t, 5> kTypes{kData, kHeaders, kContinuation, kContinuation, kReset};
  std::string bytes = kHttp2Opening;
  for (int frame = 0; frame < 40; ++frame)
    bytes += http2_frame(kTypes[random() % kTypes.size()], 0, 1, std::string(random() % 6000, '\x09'));
  return bytes;
}

TEST(FrameCheckPiecesTest, TheSizesOfThePiecesDoNotChangeTheResult) {
  std::mt19937_64 random(20261123);
  int refused = 0;
  for (int round = 0; round < 300; ++round) {
    const std::string bytes = random_frames(random);
    FrameCheck whole, in_pieces;
    const char* expected = whole.refusal(bytes, {});
    const char* reason = nullptr;
    for (size_t at = 0; at < bytes.size() && reason == nullptr;) {
      const size_t size = 1 + random() % (round % 2 == 0 ? 7 : 20'000);
      reason = in_pieces.refusal(absl::string_view(bytes).substr(at, size), {});
      at += size;
    }
    EXPECT_EQ(reason, expected) << "round " << round;
    refused += expected != nullptr ? 1 : 0;
  }
  EXPECT_GT(refused, 30);
  EXPECT_LT(refused, 270);
}

}  // namespace
}  // namespace locus::server
