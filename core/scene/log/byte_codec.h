// What all that a scene writes to its log is made of: numbers of 8 bytes, little-endian, and columns of numbers that
// start at multiples of 8, so that whoever reads them gets spans of the bytes themselves. For the codecs of records,
// state and meshes beside it; one thread at a time.
//
// Bytes to be read are trusted with nothing: a disk may have damaged them. Once anything is wrong a reader gives zeros
// and empty columns, and status() says what it was.
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

static_assert(std::endian::native == std::endian::little, "columns are read and written as they lie in memory");

class ByteWriter {
 public:
  static constexpr size_t kAlignment = 8;

  // Appends to `to`, whose size is a multiple of 8.
  explicit ByteWriter(std::string& to) : to_(to) { LOCUS_DCHECK(to.size() % kAlignment == 0); }

  void number(uint64_t value) { append(&value, sizeof(value)); }
  void number(double value) { append(&value, sizeof(value)); }
  void pair(uint32_t first, uint32_t second) { number(uint64_t{second} << 32 | first); }
  // How many there are, and the numbers.
  template <class T>
  void column(absl::Span<const T> numbers) {
    static_assert(std::is_trivially_copyable_v<T>);
    number(uint64_t{numbers.size()});
    if (numbers.empty()) return;
    append(numbers.data(), numbers.size() * sizeof(T));
    to_.append((kAlignment - to_.size() % kAlignment) % kAlignment, '\0');
  }
  // The same of a column of `width` numbers an entry, but one entry for all where all are the same, bit for bit.
  template <class T>
  void shared_column(absl::Span<const T> numbers, size_t width) {
    column(all_same(numbers, width) ? numbers.subspan(0, width) : numbers);
  }
  void text(absl::string_view text) { column(absl::Span<const char>(text.data(), text.size())); }

 private:
  template <class T>
  static bool all_same(absl::Span<const T> numbers, size_t width) {
    // Each equals the one before it.
    return numbers.size() > width &&
           std::memcmp(numbers.data(), numbers.data() + width, (numbers.size() - width) * sizeof(T)) == 0;
  }
  void append(const void* bytes, size_t size) { to_.append(static_cast<const char*>(bytes), size); }

  std::string& to_;
};

// What is wrong with bytes that were read.
inline absl::Status data_loss(absl::string_view what) { return absl::DataLossError(what); }

class ByteReader {
 public:
  // Of bytes at a multiple of 8: see AlignedBytes.
  explicit ByteReader(absl::string_view bytes) : left_(bytes) {
    LOCUS_DCHECK(reinterpret_cast<uintptr_t>(bytes.data()) % ByteWriter::kAlignment == 0);
  }

  // `what` names what is read, for the message.
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
  // A number that is at most `most`.
  uint64_t number_upto(uint64_t most, const char* what) {
    const uint64_t value = number(what);
    if (value <= most) return value;
    fail(what, "is out of range");
    return 0;
  }
  // How many things follow of which each takes at least `least_bytes`: no more than there is room for.
  uint64_t count(size_t least_bytes, const char* what) { return number_upto(left_.size() / least_bytes, what); }
  template <class T>
  absl::Span<const T> column(const char* what) {
    static_assert(std::is_trivially_copyable_v<T> && alignof(T) <= ByteWriter::kAlignment);
    const uint64_t numbers = count(sizeof(T), what);
    const size_t bytes = numbers * sizeof(T);
    const size_t padded = (bytes + ByteWriter::kAlignment - 1) / ByteWriter::kAlignment * ByteWriter::kAlignment;
    if (padded > left_.size()) fail(what, "is cut off");
    if (numbers == 0 || !good()) return {};
    const auto* first = reinterpret_cast<const T*>(left_.data());
    left_.remove_prefix(padded);
    return {first, numbers};
  }
  // `entries` entries of `width` numbers, or one for all.
  template <class T>
  absl::Span<const T> shared_column(size_t entries, size_t width, const char* what) {
    const absl::Span<const T> numbers = column<T>(what);
    if (good() && numbers.size() != entries * width && numbers.size() != width) fail(what, "has a wrong length");
    return good() ? numbers : absl::Span<const T>();
  }
  absl::string_view text(size_t most, const char* what) {
    const absl::Span<const char> text = column<char>(what);
    if (text.size() > most) fail(what, "is too long");
    return good() ? absl::string_view(text.data(), text.size()) : absl::string_view();
  }
  // That nothing is left.
  void end(const char* what) {
    if (!left_.empty()) fail(what, "has bytes too many");
  }

  bool good() const { return status_.ok(); }
  const absl::Status& status() const { return status_; }
  size_t left() const { return left_.size(); }
  // The first counts.
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

// Bytes at a multiple of 8: the given ones, or a copy of them. What is read from it may be moved about with it.
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

// How every piece of bytes begins: which kind it is and in which version of that kind it is written.
enum class BytesKind : uint32_t {
  kBatch = 0x4842'534c,
  kJoinedBatches = 0x4a42'534c,
  kStaticChange = 0x4353'534c,  // format 1: meshes by content; read only
  kNamedChange = 0x434e'534c,
  kSceneSpec = 0x5053'534c,
  kStateHeader = 0x4854'534c,
  kStateWriters = 0x5754'534c,
  kStateInstances = 0x4954'534c,  // likewise
  kNamedInstances = 0x494e'534c,
  kStateObjects = 0x4f54'534c,
  kMeshHeader = 0x484d'534c,
  kMeshVertices = 0x564d'534c,
  kMeshIndices = 0x494d'534c,
  kMeshParts = 0x504d'534c,
  kPartsHeader = 0x4850'534c,
  kTreeOutline = 0x5254'534c,
};
inline constexpr uint32_t kBytesVersion = 1;

inline void write_kind(ByteWriter& writer, BytesKind kind) { writer.pair(static_cast<uint32_t>(kind), kBytesVersion); }
// Of any kind; fails for a version that is not known.
BytesKind read_kind(ByteReader& reader);

}  // namespace locus

#endif  // LOCUS_CORE_SCENE_LOG_BYTE_CODEC_H_
