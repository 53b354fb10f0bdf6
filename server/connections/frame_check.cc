#include "server/connections/frame_check.h"

#include <algorithm>
#include <cstring>

namespace locus::server {
namespace {

// Types of frames, with the numbers of HTTP/2.
enum class Frame : uint8_t { kData = 0, kHeaders = 1, kReset = 3, kPing = 6, kWindowUpdate = 8, kContinuation = 9 };
constexpr uint8_t kEndStream = 1;  // flag of DATA

}  // namespace

const char* FrameCheck::refusal(absl::string_view bytes, Time now) {
  let_time_pass(now);
  calls_of_read_ = 0;
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
      begin_headers();
      break;
    case Frame::kContinuation:
      block_bytes_ += bytes_to_skip_;
      ++continuations_;
      break;
    case Frame::kReset:
      ++cancelled_;
      break;
    case Frame::kPing:
      ++pings_;
      break;
    case Frame::kWindowUpdate:  // a client may send one after each piece of a reply
      pings_ = std::max(0.0, pings_ - 1);
      break;
    case Frame::kData:
      if (bytes_to_skip_ > 0) pings_ = std::max(0.0, pings_ - 1);
      if (bytes_to_skip_ == 0 && (frame_header_[4] & kEndStream) == 0) ++empty_;
      break;
    default:  // SETTINGS, PRIORITY, GOAWAY and unknown types: a client sends a few in a second
      ++empty_;
  }
  if (block_bytes_ > kMaxBlockBytes || continuations_ > kMaxContinuations) return kLongHeaders;
  if (cancelled_ > kBurst) return "more calls cancelled than finished";
  if (empty_ > kBurst || pings_ > kBurst) return "too many frames that carry nothing";
  if (calls_of_read_ > kMaxCallsOfRead) return "more calls at once than it may open";
  return nullptr;
}

void FrameCheck::begin_headers() {
  block_bytes_ = bytes_to_skip_;
  continuations_ = 0;
  const uint32_t stream = (uint32_t{frame_header_[5]} & 0x7f) << 24 | uint32_t{frame_header_[6]} << 16 |
                          uint32_t{frame_header_[7]} << 8 | uint32_t{frame_header_[8]};
  const bool begins_call = stream % 2 == 1 && stream > last_stream_;
  if (!begins_call) {
    ++empty_;
    return;
  }
  last_stream_ = stream;
  ++calls_of_read_;
  cancelled_ = std::max(0.0, cancelled_ - 0.5);
  pings_ = std::max(0.0, pings_ - 1);
}

void FrameCheck::let_time_pass(Time now) {
  const double accepted = std::max(0.0, std::chrono::duration<double>(now - last_).count()) * kPerSecond;
  last_ = now;
  cancelled_ = std::max(0.0, cancelled_ - accepted);
  empty_ = std::max(0.0, empty_ - accepted);
  pings_ = std::max(0.0, pings_ - accepted);
}

}  // namespace locus::server
