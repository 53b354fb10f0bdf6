#include "server/connections/first_bytes.h"

#include <algorithm>

namespace locus::server {
namespace {

constexpr absl::string_view kPreface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
constexpr size_t kFrameHeaderBytes = 9;
constexpr uint32_t kMaxFrameBytes = 16384;  // maximum size of a frame until the peers agree on another maximum
constexpr uint32_t kSettingBytes = 6;
constexpr uint8_t kSettingsFrame = 4;
static_assert(kPreface.size() + kFrameHeaderBytes == kFirstBytes);

// Offset of the type of the handshake message, which follows the header of the record.
constexpr size_t kTlsTypeOffset = 5;
constexpr uint8_t kTlsHandshake = 22;
constexpr uint8_t kTlsMajorVersion = 3;
constexpr uint8_t kClientHello = 1;

uint8_t byte_at(absl::string_view bytes, size_t i) { return static_cast<uint8_t>(bytes[i]); }

bool is_settings_header(absl::string_view header) {
  const uint32_t length = uint32_t{byte_at(header, 0)} << 16 | uint32_t{byte_at(header, 1)} << 8 | byte_at(header, 2);
  const bool stream_is_0 = byte_at(header, 5) == 0 && byte_at(header, 6) == 0 && byte_at(header, 7) == 0;
  return length <= kMaxFrameBytes && length % kSettingBytes == 0 && byte_at(header, 3) == kSettingsFrame &&
         byte_at(header, 4) == 0 && stream_is_0 && byte_at(header, 8) == 0;
}

Opening examine_plain(absl::string_view bytes) {
  const size_t known = std::min(bytes.size(), kPreface.size());
  if (bytes.substr(0, known) != kPreface.substr(0, known)) return Opening::kBad;
  if (bytes.size() < kFirstBytes) return Opening::kIncomplete;
  return is_settings_header(bytes.substr(kPreface.size())) ? Opening::kGood : Opening::kBad;
}

Opening examine_tls(absl::string_view bytes) {
  if (!bytes.empty() && byte_at(bytes, 0) != kTlsHandshake) return Opening::kBad;
  if (bytes.size() > 1 && byte_at(bytes, 1) != kTlsMajorVersion) return Opening::kBad;
  if (bytes.size() <= kTlsTypeOffset) return Opening::kIncomplete;
  return byte_at(bytes, kTlsTypeOffset) == kClientHello ? Opening::kGood : Opening::kBad;
}

}  // namespace

Opening examine_first_bytes(Transport transport, absl::string_view bytes) {
  return transport == Transport::kTls ? examine_tls(bytes) : examine_plain(bytes);
}

}  // namespace locus::server
