#include "server/rpc/inflate.h"

#include <grpcpp/support/slice.h>
#include <zlib.h>

#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"

namespace locus::server {
namespace {

constexpr uint8_t kGzipFirst = 0x1f;
// Sizes in bytes of the first and the largest piece of the result. Each piece is twice as large as the one before,
// until the largest size is reached.
constexpr uint64_t kFirstPiece = 4096;
constexpr uint64_t kLargestPiece = 1u << 20;
constexpr int kGzipOnly = 16;  // added to zlib's windowBits, so that zlib accepts gzip streams only

absl::Status no_gzip() {
  return refuse_argument(Reason::kMalformed, "", {}, "the bytes are no complete gzip stream of one message");
}

absl::Status too_large(uint64_t max_bytes) {
  return refuse_full("", "receive_bytes", static_cast<double>(max_bytes), static_cast<double>(max_bytes + 1), 0);
}

// Inflates one gzip stream, which is given as slices. Returns the result slice by slice.
class Inflation {
 public:
  explicit Inflation(std::vector<grpc::Slice> input) : input_(std::move(input)) {
    LOCUS_CHECK_EQ(inflateInit2(&stream_, MAX_WBITS + kGzipOnly), Z_OK);
  }
  ~Inflation() { inflateEnd(&stream_); }
  Inflation(const Inflation&) = delete;
  Inflation& operator=(const Inflation&) = delete;

  // Returns the next `bytes` bytes of the result, or fewer bytes if the result ends earlier.
  absl::StatusOr<grpc::Slice> next(uint64_t bytes) {
    const grpc::Slice piece(bytes);
    stream_.next_out = const_cast<Bytef*>(piece.begin());  // writing is safe: no other slice shares the new piece
    stream_.avail_out = static_cast<uInt>(bytes);
    while (!ended_ && stream_.avail_out > 0) RETURN_IF_ERROR(step());
    return piece.sub(0, bytes - stream_.avail_out);
  }

  // Returns whether the stream has ended; INVALID_ARGUMENT if further bytes follow its end.
  absl::StatusOr<bool> ended() const {
    if (ended_ && (stream_.avail_in > 0 || next_input_ < input_.size())) return no_gzip();
    return ended_;
  }

 private:
  absl::Status step() {
    if (stream_.avail_in == 0) {
      if (next_input_ == input_.size()) return no_gzip();
      const grpc::Slice& slice = input_[next_input_++];
      stream_.next_in = const_cast<Bytef*>(slice.begin());
      stream_.avail_in = static_cast<uInt>(slice.size());
      return absl::OkStatus();
    }
    const int result = inflate(&stream_, Z_NO_FLUSH);
    if (result != Z_OK && result != Z_STREAM_END) return no_gzip();
    ended_ = result == Z_STREAM_END;
    return absl::OkStatus();
  }

  const std::vector<grpc::Slice> input_;
  size_t next_input_ = 0;
  z_stream stream_{};
  bool ended_ = false;
};

}  // namespace

bool is_gzip(const grpc::ByteBuffer& bytes) {
  std::vector<grpc::Slice> slices;
  if (!bytes.Valid() || !bytes.Dump(&slices).ok()) return false;
  for (const grpc::Slice& slice : slices)
    if (slice.size() > 0) return *slice.begin() == kGzipFirst;
  return false;
}

absl::StatusOr<std::vector<CallMemory>> inflate_gzip(ClaimBytes claim, uint64_t max_bytes, grpc::ByteBuffer& bytes) {
  std::vector<grpc::Slice> slices;
  if (!bytes.Dump(&slices).ok()) return no_gzip();
  Inflation inflation(std::move(slices));
  std::vector<grpc::Slice> result;
  std::vector<CallMemory> claims;
  uint64_t total = 0;
  for (uint64_t piece = kFirstPiece;; piece = std::min(2 * piece, kLargestPiece)) {
    ASSIGN_OR_RETURN(const bool ended, inflation.ended());
    if (ended) break;
    // One byte beyond the limit shows that the message is too large.
    const uint64_t wanted = std::min(piece, max_bytes + 1 - total);
    ASSIGN_OR_RETURN(CallMemory claimed, claim(wanted));
    claims.push_back(std::move(claimed));
    ASSIGN_OR_RETURN(grpc::Slice slice, inflation.next(wanted));
    total += slice.size();
    if (total > max_bytes) return too_large(max_bytes);
    result.push_back(std::move(slice));
  }
  grpc::ByteBuffer inflated(result.data(), result.size());
  bytes.Swap(&inflated);
  return claims;
}

}  // namespace locus::server
