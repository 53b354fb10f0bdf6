#include "server/rpc/inflate.h"

#include <gmock/gmock.h>
#include <zlib.h>

#include <string>

#include "core/base/refusal.h"

namespace locus::server {
namespace {

constexpr uint64_t kLimit = 8u << 20;

std::string gzip(const std::string& text) {
  z_stream stream{};
  EXPECT_EQ(deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, MAX_WBITS + 16, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string packed(deflateBound(&stream, text.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

// Returns a buffer of slices of `slice` bytes.
grpc::ByteBuffer buffer_of(const std::string& text, size_t slice = 1000) {
  std::vector<grpc::Slice> slices;
  for (size_t at = 0; at < text.size(); at += slice) slices.emplace_back(text.substr(at, slice));
  return grpc::ByteBuffer(slices.data(), slices.size());
}

std::string text_of(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  EXPECT_TRUE(buffer.Dump(&slices).ok());
  std::string text;
  for (const grpc::Slice& slice : slices) text.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return text;
}

// Text that does not compress well.
std::string noise(size_t bytes) {
  std::string text(bytes, '\0');
  uint32_t state = 1;
  for (char& c : text) c = static_cast<char>((state = state * 1664525 + 1013904223) >> 24);
  return text;
}

class InflateTest : public testing::Test {
 protected:
  absl::Status inflate_text(grpc::ByteBuffer& bytes, uint64_t max_bytes = 1u << 20) {
    const auto claim = [this](uint64_t amount) -> absl::StatusOr<CallMemory> {
      absl::StatusOr<MemoryBudget::Claim> claimed = memory_.claim(MemoryLine::kRequests, "", amount);
      if (!claimed.ok()) return claimed.status();
      return CallMemory(*std::move(claimed), QuotaHold(), nullptr, nullptr);
    };
    const auto claims = inflate_gzip(claim, max_bytes, bytes);
    if (claims.ok()) {
      most_claimed_ = memory_.claimed(MemoryLine::kRequests);
      EXPECT_GE(most_claimed_, bytes.Length());
    }
    return claims.status();
  }

  MemoryBudget memory_{kLimit, [] { return uint64_t{0}; }};
  uint64_t most_claimed_ = 0;
};

TEST_F(InflateTest, BytesComeBackAsTheyWere) {
  for (const size_t size : {0u, 1u, 4095u, 4096u, 4097u, 100'000u, 1u << 20}) {
    for (const std::string& text : {std::string(size, 'a'), noise(size)}) {
      for (const size_t slice : {size_t{1} + size / 1000, size_t{1} << 20}) {
        grpc::ByteBuffer bytes = buffer_of(gzip(text), slice);
        EXPECT_TRUE(is_gzip(bytes));
        EXPECT_TRUE(inflate_text(bytes).ok()) << size << " in " << slice;
        EXPECT_EQ(text_of(bytes), text);
      }
    }
  }
  EXPECT_EQ(memory_.claimed(MemoryLine::kRequests), 0u);
}

TEST_F(InflateTest, NothingBeyondTheLimitIsInflated) {
  grpc::ByteBuffer exact = buffer_of(gzip(std::string(100'000, 'a')));
  EXPECT_TRUE(inflate_text(exact, 100'000).ok());
  for (const size_t size : {100'001u, 64u << 20}) {
    grpc::ByteBuffer bytes = buffer_of(gzip(std::string(size, 'a')));
    const absl::Status status = inflate_text(bytes, 100'000);
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << size;
    EXPECT_EQ(refusal_of(status)->limit, "receive_bytes");
    EXPECT_TRUE(is_gzip(bytes)) << "unchanged";
  }
  EXPECT_EQ(memory_.claimed(MemoryLine::kRequests), 0u);
}

TEST_F(InflateTest, MemoryIsClaimedBeforeItIsUsed) {
  grpc::ByteBuffer bytes = buffer_of(gzip(std::string(64u << 20, 'a')));
  const absl::Status status = inflate_text(bytes, 1u << 30);
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refusal_of(status)->limit, "memory_bytes");
  EXPECT_EQ(memory_.claimed(MemoryLine::kRequests), 0u);
}

TEST_F(InflateTest, OtherBytesThanOneStreamAreRefused) {
  const std::string good = gzip(noise(10'000));
  std::string flipped = good;
  flipped[flipped.size() / 2] ^= 1;
  for (const std::string& bad : {good.substr(0, 1), good.substr(0, good.size() - 1), good + "a", good + good, flipped,
                                 std::string("\x1f is no gzip")}) {
    grpc::ByteBuffer bytes = buffer_of(bad);
    EXPECT_TRUE(is_gzip(bytes));
    const absl::Status status = inflate_text(bytes);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << bad.size();
    EXPECT_EQ(refusal_of(status)->reason, Reason::kMalformed);
  }
}

TEST_F(InflateTest, OnlyTheFirstByteOfGzipIsTakenForGzip) {
  EXPECT_FALSE(is_gzip(grpc::ByteBuffer()));
  EXPECT_FALSE(is_gzip(buffer_of("")));
  EXPECT_FALSE(is_gzip(buffer_of("\x0a\x1f")));
}

}  // namespace
}  // namespace locus::server
