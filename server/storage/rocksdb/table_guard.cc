#include "server/storage/rocksdb/table_guard.h"

#include <xxhash.h>

#include <cstdint>
#include <cstring>
#include <optional>

#include "absl/strings/match.h"
#include "absl/strings/string_view.h"

namespace locus::server {
namespace {

// A table ends with three parts: the metaindex block, which lists the positions of other blocks such as the properties
// block; the index block; and a footer. The footer contains the checksum type, the positions of the metaindex and index
// blocks, zeros, the format version and a magic number. Source: RocksDB 7, table formats 2 to 5.
constexpr size_t kFooterBytes = 53;
constexpr size_t kTrailerBytes = 5;  // size of the trailer of each block: compression type (u8) and checksum (u32)
constexpr char kXxh3 = 4;
constexpr absl::string_view kProperties = "rocksdb.properties";
constexpr uint64_t kMaxTableBytes = uint64_t{16} << 20;

struct Handle {
  uint64_t offset = 0;
  uint64_t size = 0;
};

std::optional<uint64_t> read_varint(absl::string_view& bytes) {
  uint64_t value = 0;
  for (int shift = 0; shift < 64 && !bytes.empty(); shift += 7) {
    const auto byte = static_cast<uint8_t>(bytes.front());
    bytes.remove_prefix(1);
    value |= uint64_t{byte & 0x7Fu} << shift;
    if (byte < 0x80) return value;
  }
  return std::nullopt;
}

std::optional<Handle> read_handle(absl::string_view bytes) {
  const auto offset = read_varint(bytes);
  const auto size = offset ? read_varint(bytes) : std::nullopt;
  return size ? std::optional(Handle{*offset, *size}) : std::nullopt;
}

// The last blocks of a table file. Verifies the checksums of the metaindex and properties blocks.
class Tail {
 public:
  Tail(rocksdb::FSRandomAccessFile& file, uint64_t size) : file_(file), size_(size) {}

  bool is_intact() {
    std::string footer, list, properties;
    if (size_ < kFooterBytes || !read(size_ - kFooterBytes, kFooterBytes, footer) || footer.front() != kXxh3)
      return false;
    const auto listed = read_handle(absl::string_view(footer).substr(1));
    if (!listed || !read_block(*listed, list)) return false;
    const size_t name = list.find(std::string(kProperties));
    if (name == std::string::npos) return false;
    const auto found = read_handle(absl::string_view(list).substr(name + kProperties.size()));
    return found && read_block(*found, properties);
  }

 private:
  bool read(uint64_t offset, uint64_t size, std::string& bytes) {
    if (size > kMaxTableBytes || offset > size_ || size > size_ - offset) return false;
    bytes.resize(size);
    rocksdb::Slice found;
    const rocksdb::IOStatus status = file_.Read(offset, size, rocksdb::IOOptions(), &found, bytes.data(), nullptr);
    if (!status.ok() || found.size() != size) return false;
    if (found.data() != bytes.data()) bytes.assign(found.data(), found.size());
    return true;
  }

  bool read_block(const Handle& handle, std::string& bytes) {
    if (handle.size > kMaxTableBytes || !read(handle.offset, handle.size + kTrailerBytes, bytes)) return false;
    uint32_t stored = 0;
    std::memcpy(&stored, bytes.data() + handle.size + 1, sizeof(stored));
    const auto compression = static_cast<uint8_t>(bytes[handle.size]);
    const auto computed = static_cast<uint32_t>(XXH3_64bits(bytes.data(), handle.size)) ^ compression * 0x6B9083D9u;
    bytes.resize(handle.size);
    return computed == stored;
  }

  rocksdb::FSRandomAccessFile& file_;
  const uint64_t size_;
};

}  // namespace

rocksdb::IOStatus TableGuard::NewRandomAccessFile(const std::string& path, const rocksdb::FileOptions& options,
                                                  std::unique_ptr<rocksdb::FSRandomAccessFile>* file,
                                                  rocksdb::IODebugContext* context) {
  rocksdb::IOStatus status = FileSystemWrapper::NewRandomAccessFile(path, options, file, context);
  if (!status.ok() || !absl::EndsWith(path, ".sst")) return status;
  uint64_t size = 0;
  status = GetFileSize(path, options.io_options, &size, context);
  if (status.ok() && !Tail(**file, size).is_intact())
    status = rocksdb::IOStatus::Corruption("the end of the table is damaged", path);
  if (!status.ok()) file->reset();
  return status;
}

}  // namespace locus::server
