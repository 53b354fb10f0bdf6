#include "server/connections/frame_check.h"

#include <algorithm>
#include <cstring>

namespace locus::server {
namespace {

// Types of frames, with the numbers of HTTP/2.
enum class Frame : uint8_t { kData = 0, kHeaders = 1, kReset = 3, kWindowUpdate = 8, kContinuation = 9 };
constexpr uint8_t kEndStream = 1;  // flag of DATA

}  // namespace

const char* FrameCheck::refusal(absl::string_view bytes, Time now) {
  let_time_pass(now);
  while (!bytes.empty()) {
    if (bytes_to_skip_ > 0) {
      const size_t skipped = static_cast<size_t>(std::min<uint64_t>(bytes_to_skip_, bytes.size()));
      bytes_to_skip_ -= skipped;
      bytes.remove_prefix(skipped);
      continue;
    }
    const size_t taken = std::min(kFrameHeaderBytes - frame_header_size_, bytes.size());
    std::memcpy(frame_header_.data() + frame_header_size_, bytes.data(), taken);
    frame_header_size_ += taken;
    bytes.remove_prefix(taken);
    if (frame_header_size_ < kFrameHeaderBytes) continue;
    if (const char* reason = begin_frame(); reason != nullptr) return reason;
  }
  return nullptr;
}

const char* FrameCheck::begin_frame() {
  frame_header_size_ = 0;
  bytes_to_skip_ = uint64_t{frame_header_[0]} << 16 | uint64_t{frame_header_[1]} << 8 | frame_header_[2];
  switch (static_cast<Frame>(frame_header_[3])) {
    case Frame::kHeaders:
      block_bytes_ = bytes_to_skip_;
      continuations_ = 0;
      cancelled_ = std::max(0.0, cancelled_ - 0.5);
      break;
    case Frame::kContinuation:
      block_bytes_ += bytes_to_skip_;
      ++continuations_;
      break;
    case Frame::kReset:
      ++cancelled_;
      break;
    case Frame::kWindowUpdate:  // one may follow each piece of a reply
      break;
    case Frame::kData:
      if (bytes_to_skip_ == 0 && (frame_header_[4] & kEndStream) == 0) ++empty_;
      break;
    default:  // SETTINGS, PING, PRIORITY, GOAWAY and unknown types: a client sends a few in a second
      ++empty_;
  }
  if (block_bytes_ > kMaxBlockBytes || continuations_ > kMaxContinuations)
    return "a block of headers that is too long or in too many frames";
  if (cancelled_ > kBurst) return "more calls cancelled than finished";
  if (empty_ > kBurst) return "too many frames that carry nothing";
  return nullptr;
}

void FrameCheck::let_time_pass(Time now) {
  const double accepted = std::max(0.0, std::chrono::duration<double>(now - last_).count()) * kPerSecond;
  last_ = now;
  cancelled_ = std::max(0.0, cancelled_ - accepted);
  empty_ = std::max(0.0, empty_ - accepted);
}

}  // namespace locus::server
