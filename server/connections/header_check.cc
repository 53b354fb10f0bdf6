#include "server/connections/header_check.h"

#include <algorithm>
#include <cstring>

namespace locus::server {
namespace {

constexpr uint8_t kHeaders = 1;
constexpr uint8_t kContinuation = 9;

}  // namespace

bool HeaderCheck::accepts(absl::string_view bytes) {
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
    if (frame_header_size_ == kFrameHeaderBytes && !begin_frame()) return false;
  }
  return true;
}

bool HeaderCheck::begin_frame() {
  frame_header_size_ = 0;
  bytes_to_skip_ = uint64_t{frame_header_[0]} << 16 | uint64_t{frame_header_[1]} << 8 | frame_header_[2];
  const uint8_t type = frame_header_[3];
  if (type == kHeaders) {
    block_bytes_ = bytes_to_skip_;
    continuations_ = 0;
  } else if (type == kContinuation) {
    block_bytes_ += bytes_to_skip_;
    ++continuations_;
  }
  return block_bytes_ <= kMaxBlockBytes && continuations_ <= kMaxContinuations;
}

}  // namespace locus::server
