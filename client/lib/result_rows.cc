#include "client/lib/result_rows.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace locus::client {
namespace {

struct ColumnLength {
  const char* name;
  int entries;
  int per_row;
};

std::vector<ColumnLength> lengths_of(const v1::BlockResult& block) {
  return {{"t", block.t_size(), 1},
          {"ids", block.ids_size(), 1},
          {"triangles", block.triangles_size(), 1},
          {"uvs", block.uvs_size(), 2},
          {"normals", block.normals_size(), 3},
          {"points", block.points_size(), 3},
          {"groups", block.groups_size(), 1},
          {"tags", block.tags_size(), 1},
          {"layers", block.layers_size(), 1},
          {"positions", block.positions_size(), 3},
          {"rotations", block.rotations_size(), 4},
          {"others", block.others_size(), 1},
          {"shapes", block.shapes_size(), 1},
          {"sizes", block.sizes_size(), 4}};
}

absl::Status contradiction(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("the server's answer contradicts itself: ", what));
}

// Returns the number of rows of a block that has no column of row counts. The number is derived from the first column
// that is present; it is 0 if no column is present.
size_t dense_rows(const std::vector<ColumnLength>& columns) {
  for (const ColumnLength& column : columns) {
    if (column.entries > 0) return static_cast<size_t>(column.entries / column.per_row);
  }
  return 0;
}

std::vector<size_t> begins_of(const v1::BlockResult& block, const std::vector<ColumnLength>& columns) {
  const bool dense = block.counts().empty();
  const size_t queries = dense ? dense_rows(columns) : static_cast<size_t>(block.counts_size());
  std::vector<size_t> begins(queries + 1);
  for (size_t query = 0; query < queries; ++query) {
    begins[query + 1] = begins[query] + (dense ? 1 : block.counts(static_cast<int>(query)));
  }
  return begins;
}

}  // namespace

absl::StatusOr<ResultRows> ResultRows::of(const v1::BlockResult& block) {
  const std::vector<ColumnLength> columns = lengths_of(block);
  std::vector<size_t> begins = begins_of(block, columns);
  const size_t rows = begins.back();
  for (const ColumnLength& column : columns) {
    const size_t entries = static_cast<size_t>(column.entries);
    if (entries != 0 && entries != rows * static_cast<size_t>(column.per_row)) {
      return contradiction(absl::StrCat(column.name, " has ", entries, " entries for ", rows, " rows"));
    }
  }
  return ResultRows(block, std::move(begins));
}

bool ResultRows::truncated(size_t query) const {
  const auto& cut = block_->truncated();
  return std::binary_search(cut.begin(), cut.end(), query);
}

bool ResultRows::clamped(size_t query) const {
  const auto& clamped = block_->clamped();
  return std::binary_search(clamped.begin(), clamped.end(), query);
}

bool ResultRows::unanchored(size_t query) const {
  const auto& unanchored = block_->unanchored();
  return std::binary_search(unanchored.begin(), unanchored.end(), query);
}

absl::StatusOr<RayHits> RayHits::of(const v1::BlockResult& block) {
  ASSIGN_OR_RETURN(ResultRows rows, ResultRows::of(block));
  if (rows.t().size() != rows.rows() || rows.ids().size() != rows.rows()) {
    return absl::InvalidArgumentError("ray hits need the columns T and ID: ask for them, or for the default columns");
  }
  return RayHits(std::move(rows));
}

bool RayHits::hit(size_t ray) const { return id(ray) != 0; }

float RayHits::t(size_t ray) const {
  const RowRange range = rows_.rows_of(ray);
  return range.size() > 0 ? rows_.t()[range.begin] : std::numeric_limits<float>::infinity();
}

uint64_t RayHits::id(size_t ray) const {
  const RowRange range = rows_.rows_of(ray);
  return range.size() > 0 ? rows_.ids()[range.begin] : 0;
}

uint32_t RayHits::triangle(size_t ray) const {
  const RowRange range = rows_.rows_of(ray);
  return range.size() > 0 && !rows_.triangles().empty() ? rows_.triangles()[range.begin] : kNoTriangle;
}

absl::StatusOr<AnyHits> AnyHits::of(const v1::BlockResult& block) {
  if (block.counts_size() > 0 || block.ids_size() > 0) {
    return absl::InvalidArgumentError("this block has rows: it does not answer rays of mode ANY");
  }
  return AnyHits(block);
}

absl::StatusOr<Overlaps> Overlaps::of(const v1::BlockResult& block) {
  ASSIGN_OR_RETURN(ResultRows rows, ResultRows::of(block));
  if (rows.ids().size() != rows.rows()) {
    return absl::InvalidArgumentError("overlaps need the column ID: ask for it, or for the default columns");
  }
  return Overlaps(std::move(rows));
}

absl::Span<const uint64_t> Overlaps::ids(size_t query) const {
  const RowRange range = rows_.rows_of(query);
  return rows_.ids().subspan(range.begin, range.size());
}

absl::Span<const uint32_t> Overlaps::triangles(size_t query) const {
  const RowRange range = rows_.rows_of(query);
  if (rows_.triangles().empty()) return {};
  return rows_.triangles().subspan(range.begin, range.size());
}

absl::StatusOr<SightMatrix> SightMatrix::of(const v1::BlockResult& block, size_t viewers, size_t targets) {
  if (block.sight().size() != viewers * targets) {
    return absl::InvalidArgumentError(
        absl::StrCat("this block has ", block.sight().size(), " bytes of sight, not ", viewers, " x ", targets));
  }
  return SightMatrix(block, targets);
}

absl::StatusOr<FreeSpaces> FreeSpaces::of(const v1::BlockResult& block) {
  ASSIGN_OR_RETURN(ResultRows rows, ResultRows::of(block));
  if (rows.t().size() != rows.rows() || rows.ids().size() != rows.rows()) {
    return absl::InvalidArgumentError("cells need the columns T and ID: ask for them, or for the default columns");
  }
  return FreeSpaces(std::move(rows));
}

float FreeSpaces::radius(size_t query) const {
  const RowRange range = rows_.rows_of(query);
  return range.size() > 0 ? rows_.t()[range.begin] : 0;
}

RowRange FreeSpaces::planes(size_t query) const {
  const RowRange range = rows_.rows_of(query);
  return {range.size() > 0 ? range.begin + 1 : range.end, range.end};
}

}  // namespace locus::client
