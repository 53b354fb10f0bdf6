// Checks the frames of HTTP/2 that a client sends, in the pieces in which they are read. Refuses what no honest client
// sends: a block of headers that is too long or consists of too many frames, many calls of which most are cancelled,
// and many frames that carry nothing. gRPC 1.51 limits none of them: it uses up to 27 bytes of memory for a byte of
// headers, needs quadratic time to parse a text that arrives byte by byte (CVE-2023-33953), and creates a call for each
// block of headers (CVE-2023-44487). The check reads only the 9 bytes before each frame, so its cost depends on the
// number of frames.
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

  // Maximum bytes of a block of headers before decoding. gRPC accepts 8 KiB after decoding, and encoding makes a text
  // at most 3.75 times as long, so gRPC would refuse a longer block anyway.
  static constexpr uint64_t kMaxBlockBytes = 64 << 10;
  // Maximum CONTINUATION frames of a block. A client needs one for each 16 KiB after the first.
  static constexpr uint32_t kMaxContinuations = 8;
  // Rates for three counts: cancelled calls, less half of all calls; frames that carry nothing; and PING frames, less
  // the frames that begin calls, carry data, or update windows. Each count may grow by kPerSecond in a second and, in a
  // burst, by kBurst more. Honest clients need bursts: all open calls of a client can be cancelled together when they
  // reach the same deadline, and clients in Go send a PING after each piece of a reply.
  static constexpr double kPerSecond = 1000;
  static constexpr double kBurst = 1000;
  // Maximum calls that begin in the bytes of one read. The maximum is needed because gRPC creates all of these calls
  // before it accepts the first one. It is above the number of calls that a client may have open.
  static constexpr uint32_t kMaxCallsOfRead = 2048;

  // Reason for which a block of headers that exceeds kMaxBlockBytes or kMaxContinuations is refused. Callers recognise
  // the reason by its address, so it is an array: each file could have its own copy of a string literal.
  static constexpr char kLongHeaders[] = "a block of headers that is too long or in too many frames";

  // Checks the next bytes of the connection, which were read at `now`. Returns null if the bytes are accepted.
  // Otherwise returns the reason why the connection must be closed, a constant string; after that, results of further
  // calls are meaningless.
  const char* refusal(absl::string_view bytes, Time now);

 private:
  static constexpr size_t kPrefaceBytes = 24;
  static constexpr size_t kFrameHeaderBytes = 9;

  // Checks a frame whose header is complete. Returns null if the frame is accepted, otherwise the reason of the
  // refusal.
  const char* begin_frame();
  // Counts a HEADERS frame. It begins a call only if its stream number is odd, as the numbers of clients' streams are,
  // and higher than the numbers of all earlier calls.
  void begin_headers();
  // Subtracts from each count the number that is accepted in the time since the last read.
  void let_time_pass(Time now);

  uint64_t bytes_to_skip_ = kPrefaceBytes;  // rest of the preface, or of the current frame
  std::array<uint8_t, kFrameHeaderBytes> frame_header_{};
  size_t frame_header_size_ = 0;  // bytes of the next frame's header that have arrived
  uint64_t block_bytes_ = 0;
  uint32_t continuations_ = 0;
  uint32_t last_stream_ = 0;    // number of the last stream that began a call
  uint32_t calls_of_read_ = 0;  // calls that began in the current read
  // Counts that decrease by kPerSecond each second, but never below 0: cancelled calls, less half of all calls; frames
  // that carry nothing; and PING frames, less the frames that begin calls, carry data, or update windows.
  double cancelled_ = 0;
  double empty_ = 0;
  double pings_ = 0;
  Time last_;  // time of the last read
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONNECTIONS_FRAME_CHECK_H_
