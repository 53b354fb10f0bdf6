// Rows of the data directory: each decoder refuses its bytes or returns a row that is encoded to the same bytes.
#include <optional>

#include "server/storage/rocksdb/rows.h"
#include "tests/fuzz/fuzz_target.h"

namespace locus::server {
namespace {

template <class Row>
void check_row(const std::optional<Row>& row, absl::string_view bytes) {
  if (row) LOCUS_CHECK(encode(*row) == bytes);
}

LOCUS_FUZZ_TARGET(rows) {
  if (input.empty()) return;
  const absl::string_view bytes = input.substr(1);
  switch (static_cast<uint8_t>(input[0]) % 6) {
    case 0:
      return check_row(decode_scene(bytes), bytes);
    case 1:
      return check_row(decode_catalogue(bytes), bytes);
    case 2:
      return check_row(decode_content(bytes), bytes);
    case 3:
      return check_row(decode_mesh(bytes), bytes);
    case 4: {
      const std::optional<LogEntry> entry = decode_record(bytes);
      if (!entry) return;
      LOCUS_CHECK_EQ(entry->bytes.size() + kRecordOverhead, bytes.size());
      LOCUS_CHECK(record_head(*entry) == bytes.substr(0, kRecordHeadBytes));
      return;
    }
    default: {
      const std::string stored = with_checksum("key", bytes);
      LOCUS_CHECK(verified("key", stored) == bytes);
      LOCUS_CHECK(!verified("kez", stored).has_value());
      const std::optional<absl::string_view> raw = verified("key", bytes);
      if (raw) LOCUS_CHECK(with_checksum("key", *raw) == bytes);
    }
  }
}

}  // namespace
}  // namespace locus::server
