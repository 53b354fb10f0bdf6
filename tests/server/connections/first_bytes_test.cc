#include "server/connections/first_bytes.h"

#include <gtest/gtest.h>

#include <string>

namespace locus::server {
namespace {

const std::string kPreface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

std::string frame_header(uint32_t length, char type, char flags = 0, char stream = 0) {
  return {static_cast<char>(length >> 16),
          static_cast<char>(length >> 8),
          static_cast<char>(length),
          type,
          flags,
          0,
          0,
          0,
          stream};
}

TEST(FirstBytesTest, AClientOfHttp2BeginsWithThePrefaceAndSettings) {
  EXPECT_EQ(examine_first_bytes(Transport::kPlain, kPreface + frame_header(0, 4)), Opening::kGood);
  EXPECT_EQ(examine_first_bytes(Transport::kPlain, kPreface + frame_header(36, 4)), Opening::kGood);
}

TEST(FirstBytesTest, EachBeginningOfAGoodOpeningIsIncomplete) {
  const std::string good = kPreface + frame_header(36, 4);
  ASSERT_EQ(good.size(), kFirstBytes);
  for (size_t size = 0; size < good.size(); ++size)
    EXPECT_EQ(examine_first_bytes(Transport::kPlain, good.substr(0, size)), Opening::kIncomplete) << size;
}

TEST(FirstBytesTest, EachChangedByteOfThePrefaceIsBad) {
  const std::string good = kPreface + frame_header(36, 4);
  for (size_t i = 0; i < kPreface.size(); ++i) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 1);
    EXPECT_EQ(examine_first_bytes(Transport::kPlain, bad.substr(0, i + 1)), Opening::kBad) << i;
    EXPECT_EQ(examine_first_bytes(Transport::kPlain, bad), Opening::kBad) << i;
  }
}

TEST(FirstBytesTest, AnotherFirstFrameThanSettingsIsBad) {
  for (const std::string& header :
       {frame_header(8, 6), frame_header(0, 0), frame_header(0, 4, 1), frame_header(0, 4, 0, 1), frame_header(5, 4),
        frame_header(16386, 4), frame_header(0xffffff, 4)})
    EXPECT_EQ(examine_first_bytes(Transport::kPlain, kPreface + header), Opening::kBad);
}

TEST(FirstBytesTest, OtherProtocolsAreBad) {
  for (const std::string& text : {std::string("GET / HTTP/1.1\r\n"), std::string("\0", 1), std::string("\x16\x03\x01"),
                                  std::string("SSH-2.0"), std::string("PRI * HTTP/2.1\r\n")})
    EXPECT_EQ(examine_first_bytes(Transport::kPlain, text), Opening::kBad) << text;
}

TEST(FirstBytesTest, AClientOfTlsBeginsWithAClientHello) {
  const std::string hello("\x16\x03\x01\x02\x00\x01", 6);
  EXPECT_EQ(examine_first_bytes(Transport::kTls, hello), Opening::kGood);
  for (size_t size = 0; size < hello.size(); ++size)
    EXPECT_EQ(examine_first_bytes(Transport::kTls, hello.substr(0, size)), Opening::kIncomplete) << size;
  EXPECT_EQ(examine_first_bytes(Transport::kTls, kPreface), Opening::kBad);
  EXPECT_EQ(examine_first_bytes(Transport::kTls, std::string("\x16\x02", 2)), Opening::kBad);
  EXPECT_EQ(examine_first_bytes(Transport::kTls, std::string("\x16\x03\x01\x02\x00\x02", 6)), Opening::kBad);
}

}  // namespace
}  // namespace locus::server
