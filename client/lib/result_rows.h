// Views that access the columns of a query result by query and row. For readers of v1::QueryResult. A view borrows its
// block and copies no columns; it only stores the index of each query's first row. Views are immutable, so any number
// of threads may read a view.
//
// of() checks the lengths of the columns once. It returns DATA_LOSS if they are inconsistent, and INVALID_ARGUMENT if
// the block lacks a column that the view needs or answers another kind of query. So no access runs past the end of a
// column, even if the server sent a malformed result. Indices of queries and rows are not checked, as in
// std::vector::operator[].
#ifndef LOCUS_CLIENT_LIB_RESULT_ROWS_H_
#define LOCUS_CLIENT_LIB_RESULT_ROWS_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/types/span.h"
#include "locus/v1/query_service.pb.h"

namespace locus::client {

inline constexpr uint32_t kNoTriangle = 0xFFFFFFFFu;

// Rows [begin, end) of a block.
struct RowRange {
  size_t begin = 0;
  size_t end = 0;

  size_t size() const { return end - begin; }
};

// View of the rows of a block of any kind: the range of rows of each query, and the requested columns.
class ResultRows {
 public:
  // Returns a view, or DATA_LOSS if the lengths of the columns are inconsistent.
  static absl::StatusOr<ResultRows> of(const v1::BlockResult& block);

  // Return the number of queries, and the number of rows of all queries. With count_only(), rows() counts rows that the
  // block does not contain.
  size_t queries() const { return begins_.size() - 1; }
  size_t rows() const { return begins_.back(); }
  RowRange rows_of(size_t query) const { return {begins_[query], begins_[query + 1]}; }
  // Returns whether the query's answer may be incomplete, because a limit on rows, planes, work or the size of the
  // reply was reached.
  bool truncated(size_t query) const;
  // Return the effective time of each query; empty for blocks without as_of().
  absl::Span<const uint64_t> resolved_ticks() const { return block_->resolved_ticks(); }
  absl::Span<const float> resolved_fractions() const { return block_->resolved_fractions(); }
  // Returns whether the query's time was outside the recorded history, so that it was answered at the nearest recorded
  // time.
  bool clamped(size_t query) const;
  // Returns whether the query has no rows because of its anchor: the anchor does not exist at the query's time, or a
  // position of the query would lie outside the world.
  bool unanchored(size_t query) const;

  // Return columns with one entry per row. A column that was not requested is empty.
  absl::Span<const float> t() const { return block_->t(); }
  absl::Span<const uint64_t> ids() const { return block_->ids(); }
  absl::Span<const uint32_t> triangles() const { return block_->triangles(); }
  absl::Span<const uint64_t> groups() const { return block_->groups(); }
  absl::Span<const uint64_t> tags() const { return block_->tags(); }
  absl::Span<const uint32_t> layers() const { return block_->layers(); }
  // Returns the second object of each pair.
  absl::Span<const uint64_t> others() const { return block_->others(); }
  // Returns the kind of shape of each object, as numbered in v1::BlockResult.shapes.
  absl::Span<const uint32_t> shapes() const { return block_->shapes(); }
  // Return columns with several values per row: 2 for uvs, 4 for rotations and sizes, 3 for normals, points and
  // positions. A column that was not requested is empty.
  absl::Span<const float> uvs() const { return block_->uvs(); }
  absl::Span<const float> normals() const { return block_->normals(); }
  absl::Span<const float> points() const { return block_->points(); }
  absl::Span<const double> positions() const { return block_->positions(); }
  absl::Span<const float> rotations() const { return block_->rotations(); }
  absl::Span<const float> sizes() const { return block_->sizes(); }

 private:
  ResultRows(const v1::BlockResult& block, std::vector<size_t> begins) : block_(&block), begins_(std::move(begins)) {}

  const v1::BlockResult* block_;
  std::vector<size_t> begins_;  // first row of each query, followed by the total number of rows
};

// View of the rows of rays, sweeps and nearest queries. The rows of a nearest query ascend by distance. For rays and
// sweeps in mode FIRST there is one row per query, and a miss has id 0; in mode ALL the rows of a query ascend by t.
// Needs the columns T and ID, which are returned by default.
class RayHits {
 public:
  static absl::StatusOr<RayHits> of(const v1::BlockResult& block);

  const ResultRows& rows() const { return rows_; }
  size_t size() const { return rows_.queries(); }
  // Returns whether the ray has a hit.
  bool hit(size_t ray) const;
  // Return the columns of the ray's nearest hit; +infinity, 0 and kNoTriangle for a miss. triangle() also returns
  // kNoTriangle for a hit on an object, and if the column of triangles was not requested; for a hit on a compound, it
  // returns the number of the part.
  float t(size_t ray) const;
  uint64_t id(size_t ray) const;
  uint32_t triangle(size_t ray) const;

 private:
  explicit RayHits(ResultRows rows) : rows_(std::move(rows)) {}

  ResultRows rows_;
};

// View of the result of rays and sweeps of mode ANY: one byte per query.
class AnyHits {
 public:
  static absl::StatusOr<AnyHits> of(const v1::BlockResult& block);

  size_t size() const { return block_->hits().size(); }
  bool hit(size_t ray) const { return block_->hits()[ray] != 0; }

 private:
  explicit AnyHits(const v1::BlockResult& block) : block_(&block) {}

  const v1::BlockResult* block_;
};

// View of the rows of overlap and contains queries: for each query a span of ids, and a span of triangles if they were
// requested. Needs the column ID, which is returned by default.
class Overlaps {
 public:
  static absl::StatusOr<Overlaps> of(const v1::BlockResult& block);

  const ResultRows& rows() const { return rows_; }
  size_t size() const { return rows_.queries(); }
  // Returns the ids that the query found, in ascending order. If the block requested one row per triangle, the id of an
  // instance is repeated for each triangle found.
  absl::Span<const uint64_t> ids(size_t query) const;
  // Returns the triangle, or the part of a compound, of each entry of ids(query); empty if the column was not
  // requested.
  absl::Span<const uint32_t> triangles(size_t query) const;

 private:
  explicit Overlaps(ResultRows rows) : rows_(std::move(rows)) {}

  ResultRows rows_;
};

// View of the result of a sight block: one byte for each pair of a viewer and a target. In a pairwise block, only the
// pairs with equal indices have a byte.
class SightMatrix {
 public:
  // Returns a view of the answer to `viewers` viewers and `targets` targets; for a pairwise block, `targets` is 1.
  // Returns INVALID_ARGUMENT if the block has another number of bytes.
  static absl::StatusOr<SightMatrix> of(const v1::BlockResult& block, size_t viewers, size_t targets);

  // Returns how many samples of the target the viewer sees, at most 255.
  uint32_t seen(size_t viewer, size_t target) const {
    return static_cast<uint8_t>(block_->sight()[viewer * targets_ + target]);
  }

 private:
  SightMatrix(const v1::BlockResult& block, size_t targets) : block_(&block), targets_(targets) {}

  const v1::BlockResult* block_;
  size_t targets_;
};

// View of the result of a cell block: the convex free space around each point. Needs the columns T and ID, which are
// returned by default.
class FreeSpaces {
 public:
  static absl::StatusOr<FreeSpaces> of(const v1::BlockResult& block);

  const ResultRows& rows() const { return rows_; }
  size_t size() const { return rows_.queries(); }
  // Returns the radius of the ball that bounds the space; 0 if there is no space, because the point lies in or on an
  // object or a triangle.
  float radius(size_t query) const;
  // Returns the range of the rows that are planes of the space, as indices into the columns of rows().
  RowRange planes(size_t query) const;

 private:
  explicit FreeSpaces(ResultRows rows) : rows_(std::move(rows)) {}

  ResultRows rows_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_RESULT_ROWS_H_
