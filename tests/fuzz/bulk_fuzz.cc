// Rows for bulk queries and updates in csv and ndjson: accepted rows have valid values in every column, and an error
// names the file.
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cli/rows/bulk/row_reader.h"
#include "core/base/limits.h"
#include "tests/fuzz/fuzz_target.h"

namespace locus::cli {
namespace {

constexpr size_t kMaxRows = 64;

// File in memory with the bytes of one input, readable by path.
class MemoryFile {
 public:
  explicit MemoryFile(absl::string_view bytes) : descriptor_(memfd_create("rows", MFD_CLOEXEC)) {
    LOCUS_CHECK(write(descriptor_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()));
  }
  ~MemoryFile() { close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::string path() const { return absl::StrCat("/proc/self/fd/", descriptor_); }

 private:
  int descriptor_;
};

RowSchema schema_of_all_kinds() {
  return {{.name = "from", .kind = FieldKind::kCoordinate, .parts = "xyz", .required = true},
          {.name = "rotation", .parts = "xyzw"},
          {.name = "max_t", .kind = FieldKind::kDistance, .aliases = {"t_max"}},
          {.name = "id", .kind = FieldKind::kId},
          {.name = "layers", .kind = FieldKind::kBits, .option = "--layers"},
          {.name = "mask", .kind = FieldKind::kBits},
          {.name = "mode", .kind = FieldKind::kWord, .words = {"first", "any", "all"}}};
}

void check_value(FieldKind kind, double value) {
  LOCUS_CHECK(kind == FieldKind::kDistance ? value >= 0 : std::isfinite(value));
  if (kind == FieldKind::kCoordinate) LOCUS_CHECK(std::abs(value) <= limits::kMaxCoordinate);
}

void check_rows(const RowSchema& schema, const RowBatch& batch) {
  LOCUS_CHECK_LE(batch.rows(), kMaxRows);
  LOCUS_CHECK_EQ(batch.columns.size(), schema.size());
  for (size_t i = 0; i < schema.size(); ++i) {
    const RowColumn& column = batch.columns[i];
    LOCUS_CHECK_EQ(column.given.size(), batch.rows());
    LOCUS_CHECK_EQ(column.numbers.size() + column.integers.size(),
                   batch.rows() * (column.integers.empty() ? schema[i].size() : 1));
    for (const double value : column.numbers) check_value(schema[i].kind, value);
    for (const uint64_t value : column.integers) {
      if (schema[i].kind == FieldKind::kBits) LOCUS_CHECK_LE(value, UINT32_MAX);
      if (schema[i].kind == FieldKind::kWord) LOCUS_CHECK_LT(value, schema[i].words.size());
    }
    if (schema[i].required) LOCUS_CHECK(column.all());
    if (!schema[i].option.empty()) LOCUS_CHECK(!column.any());
  }
}

void read_rows(absl::string_view input, RowFormat format) {
  const MemoryFile file(input);
  absl::StatusOr<ByteInput> bytes = ByteInput::open(file.path());
  LOCUS_CHECK(bytes.ok());
  RowReader reader(*std::move(bytes), format, schema_of_all_kinds());
  for (BatchEnd end = BatchEnd::kFull; end != BatchEnd::kEnd;) {
    RowBatch batch;
    const absl::StatusOr<BatchEnd> next = reader.next(kMaxRows, Patience::kWait, batch);
    if (!next.ok()) {
      fuzz::check_error(next.status());
      LOCUS_CHECK(absl::StartsWith(next.status().message(), absl::StrCat(file.path(), ":")));
      return;
    }
    check_rows(reader.schema(), batch);
    end = *next;
  }
}

LOCUS_FUZZ_TARGET(csv) { read_rows(input, RowFormat::kCsv); }

LOCUS_FUZZ_TARGET(ndjson) { read_rows(input, RowFormat::kNdjson); }

}  // namespace
}  // namespace locus::cli
