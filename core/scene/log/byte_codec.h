// Binary encoding of everything that a scene writes to its log: little-endian numbers of 8 bytes, and columns aligned
// to 8 bytes. A column is read in place: the result is a span of the encoded bytes. Used by the codecs of records,
// state and meshes in this folder; FORMAT.md describes the formats. One thread at a time.
//
// A reader validates everything, because a disk may damage the bytes. After the first error the reader returns zeros
// and empty columns, and status() describes the error.
#ifndef LOCUS_CORE_SCENE_LOG_BYTE_CODEC_H_
#define LOCUS_CORE_SCENE_LOG_BYTE_CODEC_H_

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/base/check.h"

namespace locus {

static_assert(std::endian::native == std::endian::little, "columns are read and written in memory order");

class ByteWriter {
 public:
  static constexpr size_t kAlignment = 8;

  // Creates a writer that appends to `to`. Precondition: the size of `to` is a multiple of 8.
  explicit ByteWriter(std::string& to) : to_(to) { LOCUS_DCHECK(to.size() % kAlignment == 0); }

  void number(uint64_t value) { append(&value, sizeof(value)); }
  void number(double value) { append(&value, sizeof(value)); }
  void pair(uint32_t first, uint32_t second) { number(uint64_t{second} << 32 | first); }
  // Writes the number of values and the values, padded with zeros to a multiple of 8 bytes.
  template <class T>
  void column(absl::Span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    number(uint64_t{values.size()});
    if (values.empty()) return;
    append(values.data(), values.size() * sizeof(T));
    to_.append((kAlignment - to_.size() % kAlignment) % kAlignment, '\0');
  }
  // Writes a column whose entries have `width` values each. If all entries are equal bit for bit, writes only one
  // entry.
  template <class T>
  void shared_column(absl::Span<const T> values, size_t width) {
    LOCUS_DCHECK(width > 0 && values.size() % width == 0);
    column(all_same(values, width) ? values.subspan(0, width) : values);
  }
  void text(absl::string_view text) { column(absl::Span<const char>(text.data(), text.size())); }

 private:
  template <class T>
  static bool all_same(absl::Span<const T> values, size_t width) {
    // Compares each entry with the next entry, by comparing the column with itself shifted by one entry.
    return values.size() > width &&
           std::memcmp(values.data(), values.data() + width, (values.size() - width) * sizeof(T)) == 0;
  }
  void append(const void* bytes, size_t size) { to_.append(static_cast<const char*>(bytes), size); }

  std::string& to_;
};

// Returns a DATA_LOSS error with the message `what`, for bytes that cannot be decoded.
inline absl::Status data_loss(absl::string_view what) { return absl::DataLossError(what); }

class ByteReader {
 public:
  // Creates a reader that borrows `bytes`. Precondition: the address of `bytes` is a multiple of 8; AlignedBytes
  // provides aligned bytes.
  explicit ByteReader(absl::string_view bytes) : left_(bytes) {
    LOCUS_DCHECK(reinterpret_cast<uintptr_t>(bytes.data()) % ByteWriter::kAlignment == 0);
  }

  // Reads an integer. In this and all other members, `what` names the value in the error message.
  uint64_t number(const char* what) {
    uint64_t value = 0;
    take(&value, sizeof(value), what);
    return value;
  }
  double real(const char* what) { return std::bit_cast<double>(number(what)); }
  struct Pair {
    uint32_t first, second;
  };
  Pair pair(const char* what) {
    const uint64_t both = number(what);
    return {static_cast<uint32_t>(both), static_cast<uint32_t>(both >> 32)};
  }
  // Reads an integer; fails if it is larger than `max`.
  uint64_t number_upto(uint64_t max, const char* what) {
    const uint64_t value = number(what);
    if (value <= max) return value;
    fail(what, "is out of range");
    return 0;
  }
  // Reads the number of items that follow. Fails if this number of items, of at least `min_bytes` bytes each, does not
  // fit into the remaining bytes.
  uint64_t count(size_t min_bytes, const char* what) {
    LOCUS_DCHECK_GT(min_bytes, 0u);
    return number_upto(left_.size() / min_bytes, what);
  }
  // Reads a column. The result is a span of the bytes that were passed to the constructor.
  template <class T>
  absl::Span<const T> column(const char* what) {
    static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= ByteWriter::kAlignment);
    const uint64_t values = count(sizeof(T), what);
    const size_t bytes = values * sizeof(T);
    const size_t padded = (bytes + ByteWriter::kAlignment - 1) / ByteWriter::kAlignment * ByteWriter::kAlignment;
    if (padded > left_.size()) fail(what, "is cut off");
    if (values == 0 || !good()) return {};
    LOCUS_DCHECK(reinterpret_cast<uintptr_t>(left_.data()) % alignof(T) == 0);
    const auto* first = reinterpret_cast<const T*>(left_.data());
    left_.remove_prefix(padded);
    return {first, values};
  }
  // Reads a column that ByteWriter::shared_column() wrote: `entries` entries of `width` values each, or one entry of
  // `width` values if all entries are equal.
  template <class T>
  absl::Span<const T> shared_column(size_t entries, size_t width, const char* what) {
    const absl::Span<const T> values = column<T>(what);
    if (good() && values.size() != entries * width && values.size() != width) fail(what, "has a wrong length");
    return good() ? values : absl::Span<const T>();
  }
  // Reads a text of at most `max` bytes.
  absl::string_view text(size_t max, const char* what) {
    const absl::Span<const char> text = column<char>(what);
    if (text.size() > max) fail(what, "is too long");
    return good() ? absl::string_view(text.data(), text.size()) : absl::string_view();
  }
  // Fails if any bytes remain.
  void end(const char* what) {
    if (!left_.empty()) fail(what, "has surplus bytes");
  }

  bool good() const { return status_.ok(); }
  const absl::Status& status() const { return status_; }
  size_t left() const { return left_.size(); }
  // Sets the error to the message "`what` `how`", unless there is an error already, and drops the remaining bytes.
  void fail(absl::string_view what, absl::string_view how);

 private:
  void take(void* to, size_t size, const char* what) {
    if (size > left_.size()) fail(what, "is cut off");
    if (!good()) return;
    std::memcpy(to, left_.data(), size);
    left_.remove_prefix(size);
  }

  absl::string_view left_;
  absl::Status status_;
};

// Bytes at an address that is a multiple of 8. Borrows the bytes passed to the constructor if they are aligned,
// otherwise holds an aligned copy. Moving this object does not change the address, so spans of the bytes stay valid.
class AlignedBytes {
 public:
  explicit AlignedBytes(absl::string_view bytes) : bytes_(bytes) {
    if (reinterpret_cast<uintptr_t>(bytes.data()) % ByteWriter::kAlignment == 0) return;
    copy_.resize((bytes.size() + sizeof(uint64_t) - 1) / sizeof(uint64_t));
    std::memcpy(copy_.data(), bytes.data(), bytes.size());
    bytes_ = absl::string_view(reinterpret_cast<const char*>(copy_.data()), bytes.size());
  }
  AlignedBytes(AlignedBytes&&) noexcept = default;
  AlignedBytes& operator=(AlignedBytes&&) noexcept = default;
  AlignedBytes(const AlignedBytes&) = delete;
  AlignedBytes& operator=(const AlignedBytes&) = delete;

  absl::string_view bytes() const { return bytes_; }

 private:
  std::vector<uint64_t> copy_;
  absl::string_view bytes_;
};

// Kind of a record or chunk. Every record and chunk begins with its kind and kBytesVersion.
enum class BytesKind : uint32_t {
  kBatch = 0x4842'534c,
  kInstanceBatch = 0x4942'534c,  // a batch that changes instances
  kExtendedBatch = 0x5842'534c,  // a batch with compounds, new poses of parts, expiry ticks or a lease
  kGroupedBatch = 0x4742'534c,   // a batch that was sent as several messages
  kJoinedBatches = 0x4a42'534c,
  kStaticChange = 0x4353'534c,  // data format 1: identifies meshes by content hash; decoded, but never written
  kNamedChange = 0x434e'534c,   // data formats 2 and 3: without the bounds of meshes; decoded, but never written
  kBoundedChange = 0x4345'534c,
  kSceneSpec = 0x5053'534c,
  kOwnedSpec = 0x534f'534c,
  kLimitedSpec = 0x534c'534c,  // a specification with lifetimes
  kSizedSpec = 0x535a'534c,    // a specification with lifetimes and a cell size
  kStateHeader = 0x4854'534c,
  kExtendedHeader = 0x4858'534c,  // like kStateHeader; also counts expiries and leases
  kStateWriters = 0x5754'534c,
  kMessageWriters = 0x4d57'534c,  // like kStateWriters; the errors of the acks also have the index of a message
  kStateInstances = 0x4954'534c,  // data format 1: identifies meshes by content hash; decoded, but never written
  kNamedInstances = 0x494e'534c,  // data formats 2 and 3: without the bounds of meshes; decoded, but never written
  kBoundedInstances = 0x4945'534c,
  kStateObjects = 0x4f54'534c,
  kStateExpiries = 0x4554'534c,
  kStateLeases = 0x4c54'534c,
  kStateCompounds = 0x4354'534c,
  kCompoundObjects = 0x4b54'534c,  // objects of which some are compounds
  kMeshHeader = 0x484d'534c,
  kMeshVertices = 0x564d'534c,
  kMeshIndices = 0x494d'534c,
  kMeshParts = 0x504d'534c,
  kPartsHeader = 0x4850'534c,
  kMeshCreator = 0x434d'534c,
  kTreeTopology = 0x5254'534c,
};
inline constexpr uint32_t kBytesVersion = 1;

inline void write_kind(ByteWriter& writer, BytesKind kind) { writer.pair(static_cast<uint32_t>(kind), kBytesVersion); }
// Reads the header of a record or chunk of any kind; fails if the version is unknown.
BytesKind read_kind(ByteReader& reader);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_BYTE_CODEC_H_
