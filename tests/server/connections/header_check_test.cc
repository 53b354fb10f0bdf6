#include "server/connections/header_check.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>

#include "tests/support/raw_socket.h"

namespace locus::server {
namespace {

using test::http2_frame;
using test::kHttp2Opening;

constexpr uint8_t kData = 0, kHeaders = 1, kContinuation = 9;

bool accepts(const std::string& bytes) {
  HeaderCheck check;
  return check.accepts(kHttp2Opening + bytes);
}

// Returns whether the bytes are accepted when they are read in pieces of random sizes.
bool accepts_in_pieces(const std::string& bytes, std::mt19937_64& random, size_t largest) {
  HeaderCheck check;
  const std::string all = kHttp2Opening + bytes;
  for (size_t at = 0; at < all.size();) {
    const size_t size = 1 + random() % largest;
    if (!check.accepts(absl::string_view(all).substr(at, size))) return false;
    at += size;
  }
  return true;
}

std::string repeated(const std::string& text, size_t times) {
  std::string all;
  for (size_t i = 0; i < times; ++i) all += text;
  return all;
}

TEST(HeaderCheckTest, BlocksUpToTheMaximaAreAccepted) {
  const std::string longest = http2_frame(kHeaders, 0, 1, std::string(HeaderCheck::kMaxBlockBytes, 'h'));
  EXPECT_TRUE(accepts(longest));
  EXPECT_TRUE(accepts(longest + http2_frame(kContinuation, 4, 1, "")));
  const std::string most = http2_frame(kHeaders, 0, 1, "h") +
                           repeated(http2_frame(kContinuation, 0, 1, "h"), HeaderCheck::kMaxContinuations);
  EXPECT_TRUE(accepts(repeated(most, 100)));
}

TEST(HeaderCheckTest, ALongerBlockIsRefused) {
  EXPECT_FALSE(accepts(http2_frame(kHeaders, 4, 1, std::string(HeaderCheck::kMaxBlockBytes + 1, 'h'))));
  const std::string half(HeaderCheck::kMaxBlockBytes / 2, 'h');
  EXPECT_FALSE(accepts(http2_frame(kHeaders, 0, 1, half + "h") + http2_frame(kContinuation, 0, 1, half)));
}

TEST(HeaderCheckTest, ABlockInMoreFramesIsRefused) {
  EXPECT_FALSE(accepts(http2_frame(kHeaders, 0, 1, "h") +
                       repeated(http2_frame(kContinuation, 0, 1, ""), HeaderCheck::kMaxContinuations + 1)));
}

TEST(HeaderCheckTest, ALongBlockIsRefusedBeforeItHasArrived) {
  std::string beginning = http2_frame(kHeaders, 4, 1, std::string(HeaderCheck::kMaxBlockBytes + 1, 'h'));
  beginning.resize(9);
  EXPECT_FALSE(accepts(beginning));
}

TEST(HeaderCheckTest, OtherFramesAreSkippedWhateverTheyContain) {
  const std::string inside = http2_frame(kHeaders, 4, 1, std::string(HeaderCheck::kMaxBlockBytes + 1, 'h'));
  EXPECT_TRUE(accepts(repeated(http2_frame(kData, 0, 1, inside), 20)));
}

// The sizes of pieces must not change the result.
TEST(HeaderCheckTest, PiecesGiveTheSameResultAsTheWhole) {
  std::mt19937_64 random(20261123);
  int refused = 0;
  for (int round = 0; round < 300; ++round) {
    std::string bytes;
    for (int frame = 0; frame < 40; ++frame) {
      constexpr std::array<uint8_t, 4> kTypes{kData, kHeaders, kContinuation, kContinuation};
      bytes += http2_frame(kTypes[random() % 4], 0, 1, std::string(random() % 6000, '\x09'));
    }
    const bool whole = accepts(bytes);
    refused += whole ? 0 : 1;
    EXPECT_EQ(accepts_in_pieces(bytes, random, round % 2 == 0 ? 7 : 20'000), whole) << "round " << round;
  }
  EXPECT_GT(refused, 30);
  EXPECT_LT(refused, 270);
}

}  // namespace
}  // namespace locus::server
