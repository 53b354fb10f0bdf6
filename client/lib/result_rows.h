// Views over the columns of a query's answer, by query and row. For readers of v1::QueryResult. A view borrows the
// block it was made from and copies nothing but an index of where each query's rows begin. Immutable, so any number of
// threads may read one.
//
// of() checks the lengths of the columns once, so that reading cannot run past them whatever a server sent: a block
// that contradicts itself is DATA_LOSS. Numbers of queries and rows are the caller's promise, as with a vector.
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

// The rows of any block: which belong to which query, and the columns that were asked for.
class ResultRows {
 public:
  static absl::StatusOr<ResultRows> of(const v1::BlockResult& block);

  // Queries, and rows of all queries.
  size_t queries() const { return begins_.size() - 1; }
  size_t rows() const { return begins_.back(); }
  RowRange rows_of(size_t query) const { return {begins_[query], begins_[query + 1]}; }
  // Whether the query had more rows than are reported.
  bool truncated(size_t query) const;
  // The time that each query asked about in fact; empty for blocks that ask about now.
  absl::Span<const uint64_t> resolved_ticks() const { return block_->resolved_ticks(); }
  absl::Span<const float> resolved_fractions() const { return block_->resolved_fractions(); }
  // Whether the query asked about a time that is not kept.
  bool clamped(size_t query) const;

  // Columns, one entry a row; empty if not asked for.
  absl::Span<const float> t() const { return block_->t(); }
  absl::Span<const uint64_t> ids() const { return block_->ids(); }
  absl::Span<const uint32_t> triangles() const { return block_->triangles(); }
  absl::Span<const uint64_t> groups() const { return block_->groups(); }
  absl::Span<const uint64_t> tags() const { return block_->tags(); }
  absl::Span<const uint32_t> layers() const { return block_->layers(); }
  // Columns of two, three or four numbers a row.
  absl::Span<const float> uvs() const { return block_->uvs(); }
  absl::Span<const float> normals() const { return block_->normals(); }
  absl::Span<const float> points() const { return block_->points(); }
  absl::Span<const double> positions() const { return block_->positions(); }
  absl::Span<const float> rotations() const { return block_->rotations(); }

 private:
  ResultRows(const v1::BlockResult& block, std::vector<size_t> begins) : block_(&block), begins_(std::move(begins)) {}

  const v1::BlockResult* block_;
  std::vector<size_t> begins_;  // one more than queries: where each one's rows begin, and the number of rows
};

// Rays FIRST (one row a ray, a miss has id 0) and ALL (the rows of a ray ascend by t), and what is nearest to points,
// likewise by distance. Wants T and ID, as by default.
class RayHits {
 public:
  static absl::StatusOr<RayHits> of(const v1::BlockResult& block);

  const ResultRows& rows() const { return rows_; }
  size_t size() const { return rows_.queries(); }
  // The ray's nearest hit.
  bool hit(size_t ray) const;
  // +infinity, 0 and kNoTriangle for a miss.
  float t(size_t ray) const;
  uint64_t id(size_t ray) const;
  uint32_t triangle(size_t ray) const;

 private:
  explicit RayHits(ResultRows rows) : rows_(std::move(rows)) {}

  ResultRows rows_;
};

// Rays ANY: one byte a ray.
class AnyHits {
 public:
  static absl::StatusOr<AnyHits> of(const v1::BlockResult& block);

  size_t size() const { return block_->hits().size(); }
  bool hit(size_t ray) const { return block_->hits()[ray] != 0; }

 private:
  explicit AnyHits(const v1::BlockResult& block) : block_(&block) {}

  const v1::BlockResult* block_;
};

// Balls and boxes: per query a span of ids, and of triangles where they were asked for. Wants ID, as by default.
class Overlaps {
 public:
  static absl::StatusOr<Overlaps> of(const v1::BlockResult& block);

  const ResultRows& rows() const { return rows_; }
  size_t size() const { return rows_.queries(); }
  // Ascending; an instance repeats for each of its triangle rows.
  absl::Span<const uint64_t> ids(size_t query) const;
  // As long as ids(query); empty if not asked for.
  absl::Span<const uint32_t> triangles(size_t query) const;

 private:
  explicit Overlaps(ResultRows rows) : rows_(std::move(rows)) {}

  ResultRows rows_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_RESULT_ROWS_H_
