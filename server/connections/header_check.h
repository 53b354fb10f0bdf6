// Checks the frames of HTTP/2 that a client sends, in the pieces in which they are read. Refuses blocks of headers that
// no honest client sends: blocks that are too long or consist of too many frames. gRPC 1.51 limits neither the length
// nor the number of frames, uses up to 27 bytes of memory for a byte of headers, and parses a text that arrives byte by
// byte in quadratic time (CVE-2023-33953). Only the 9 bytes before each frame are read, so the cost depends on the
// number of frames.
//
// Threads: one thread at a time. Source: RFC 9113, sections 3.4, 4.1, 6.2 and 6.10.
#ifndef LOCUS_SERVER_CONNECTIONS_HEADER_CHECK_H_
#define LOCUS_SERVER_CONNECTIONS_HEADER_CHECK_H_

#include <array>
#include <cstddef>
#include <cstdint>

#include "absl/strings/string_view.h"

namespace locus::server {

class HeaderCheck {
 public:
  // Maximum bytes of a block before decoding. gRPC accepts 8 KiB after decoding, and encoding makes a text at most 3.75
  // times as long, so gRPC would refuse a longer block anyway.
  static constexpr uint64_t kMaxBlockBytes = 64 << 10;
  // Maximum CONTINUATION frames of a block. A client needs one for each 16 KiB after the first.
  static constexpr uint32_t kMaxContinuations = 8;

  static constexpr const char* kReason = "a block of headers that is too long or in too many frames";

  // Checks the next bytes of the connection. Returns false if a block exceeds a maximum; then the connection must be
  // closed, and later results have no meaning.
  bool accepts(absl::string_view bytes);

 private:
  static constexpr size_t kPrefaceBytes = 24;
  static constexpr size_t kFrameHeaderBytes = 9;

  // Reads the header of a frame, which is complete. Returns false if its block exceeds a maximum.
  bool begin_frame();

  uint64_t bytes_to_skip_ = kPrefaceBytes;  // rest of the preface, or of the current frame
  std::array<uint8_t, kFrameHeaderBytes> frame_header_{};
  size_t frame_header_size_ = 0;  // bytes of the next frame's header that have arrived
  uint64_t block_bytes_ = 0;
  uint32_t continuations_ = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONNECTIONS_HEADER_CHECK_H_
