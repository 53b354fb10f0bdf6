// Binary encoding of integers and strings in rows and files of the data directory: little endian in values, big endian
// in keys, so that keys sort numerically. A reader never reads past the end of its input: if the input is too short,
// the reader returns zeros and ok() becomes false. The payloads of records and chunks have another encoding
// (core/scene/log/byte_codec.h), whose columns are aligned and read in place; rows are small and packed.
//
// Threads: only one thread at a time may use a reader or writer.
#ifndef LOCUS_SERVER_STORAGE_ROWS_ROW_CODEC_H_
#define LOCUS_SERVER_STORAGE_ROWS_ROW_CODEC_H_

#include <cstdint>
#include <string>

#include "absl/strings/string_view.h"
#include "core/base/check.h"

namespace locus::server {

class RowWriter {
 public:
  RowWriter& u8(uint8_t value) {
    bytes_.push_back(static_cast<char>(value));
    return *this;
  }
  RowWriter& u32(uint32_t value) { return little(value, 4); }
  RowWriter& u64(uint64_t value) { return little(value, 8); }
  RowWriter& big_u32(uint32_t value) { return big(value, 4); }
  RowWriter& big_u64(uint64_t value) { return big(value, 8); }
  // Appends `value` without a length.
  RowWriter& bytes(absl::string_view value) {
    bytes_.append(value.data(), value.size());
    return *this;
  }
  // Appends a 32-bit length, then `value`.
  RowWriter& string(absl::string_view value) {
    LOCUS_DCHECK_LE(value.size(), ~uint32_t{0});
    return u32(static_cast<uint32_t>(value.size())).bytes(value);
  }

  const std::string& view() const { return bytes_; }
  std::string take() { return std::move(bytes_); }

 private:
  RowWriter& little(uint64_t value, int count) {
    for (int i = 0; i < count; ++i) bytes_.push_back(static_cast<char>(value >> (8 * i)));
    return *this;
  }
  RowWriter& big(uint64_t value, int count) {
    for (int i = count; i-- > 0;) bytes_.push_back(static_cast<char>(value >> (8 * i)));
    return *this;
  }

  std::string bytes_;
};

class RowReader {
 public:
  explicit RowReader(absl::string_view bytes) : rest_(bytes) {}

  uint8_t u8() { return static_cast<uint8_t>(little(1)); }
  uint32_t u32() { return static_cast<uint32_t>(little(4)); }
  uint64_t u64() { return little(8); }
  uint32_t big_u32() { return static_cast<uint32_t>(big(4)); }
  uint64_t big_u64() { return big(8); }
  absl::string_view bytes(size_t count) {
    if (count > rest_.size()) {
      ok_ = false;
      return {};
    }
    const absl::string_view found = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return found;
  }
  std::string string() { return std::string(bytes(u32())); }

  absl::string_view rest() const { return rest_; }
  bool ok() const { return ok_; }
  // Returns whether every read succeeded and no bytes are left.
  bool ended() const { return ok_ && rest_.empty(); }

 private:
  uint64_t little(size_t count) {
    const absl::string_view found = bytes(count);
    uint64_t value = 0;
    for (size_t i = found.size(); i-- > 0;) value = value << 8 | static_cast<uint8_t>(found[i]);
    return value;
  }
  uint64_t big(size_t count) {
    uint64_t value = 0;
    for (const char byte : bytes(count)) value = value << 8 | static_cast<uint8_t>(byte);
    return value;
  }

  absl::string_view rest_;
  bool ok_ = true;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_STORAGE_ROWS_ROW_CODEC_H_
