// Checks the frames of HTTP/2 that a client sends, in the pieces in which they are read, and finds what no honest
// client sends: a block of headers that is too long or in too many frames, calls that are mostly cancelled, and too
// many frames that carry nothing. gRPC 1.51 has no limit on any of them: it keeps up to 27 bytes of memory for a byte
// of headers, parses a text that arrives byte by byte in quadratic time (CVE-2023-33953), and makes a call for each
// block of headers (CVE-2023-44487). Only the 9 bytes before each frame are read, so the cost depends on the number of
// frames.
//
// Threads: one thread at a time. Source: RFC 9113, sections 3.4, 4.1 and 6.
#ifndef LOCUS_SERVER_CONNECTIONS_FRAME_CHECK_H_
#define LOCUS_SERVER_CONNECTIONS_FRAME_CHECK_H_

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "absl/strings/string_view.h"

namespace locus::server {

class FrameCheck {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // Maximum bytes of a block of headers before decoding. gRPC accepts 8 KiB after decoding, and coding makes a text at
  // most 3.75 times as long, so a longer block is refused anyway.
  static constexpr uint64_t kMaxBlockBytes = 64 << 10;
  // Maximum CONTINUATION frames of a block. A client needs one for each 16 KiB after the first.
  static constexpr uint32_t kMaxContinuations = 8;
  // Cancelled calls beyond half of all calls, and frames that carry nothing: what is accepted each second, and at once.
  // A client whose calls all reach their deadline together cancels as many as it has open.
  static constexpr double kPerSecond = 1000;
  static constexpr double kBurst = 1000;

  // Checks the next bytes of the connection, which were read at `now`. Returns null if they are accepted, otherwise the
  // reason for which the connection must be closed, a constant; later results have no meaning.
  const char* refusal(absl::string_view bytes, Time now);

 private:
  static constexpr size_t kPrefaceBytes = 24;
  static constexpr size_t kFrameHeaderBytes = 9;

  // Checks a frame whose header is complete. Returns as refusal() does.
  const char* begin_frame();
  // Subtracts what is accepted for the time since the last read.
  void let_time_pass(Time now);

  uint64_t bytes_to_skip_ = kPrefaceBytes;  // rest of the preface, or of the present frame
  std::array<uint8_t, kFrameHeaderBytes> frame_header_{};
  size_t frame_header_size_ = 0;  // bytes of the next frame's header that have arrived
  uint64_t block_bytes_ = 0;
  uint32_t continuations_ = 0;
  double cancelled_ = 0;  // cancelled calls, less half of all calls and what is accepted each second; not below 0
  double empty_ = 0;      // frames that carry nothing, less what is accepted each second; not below 0
  Time last_;             // time of the last read
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONNECTIONS_FRAME_CHECK_H_
