// Sink that writes the answer of a query batch directly into the columns of its reply: each column is allocated once,
// and no value is copied again. Threads: only one thread at a time may use it.
#ifndef LOCUS_SERVER_CONVERT_RESULT_COLUMNS_H_
#define LOCUS_SERVER_CONVERT_RESULT_COLUMNS_H_

#include "core/query/run/answer_sink.h"
#include "locus/v1/query_service.pb.h"

namespace locus::server {

class ResultColumns final : public AnswerSink {
 public:
  // Replaces the blocks of `result`, which is borrowed, by `blocks` empty blocks. The columns of the empty blocks reuse
  // the memory of the previous blocks.
  ResultColumns(v1::QueryResult& result, size_t blocks);

  RowSpans add_rows(size_t block, ColumnSet columns, size_t rows) override;
  char* add_hits(size_t block, size_t queries) override;
  char* add_matrix(size_t block, size_t bytes) override;
  uint32_t* add_counts(size_t block, size_t queries) override;
  uint32_t* add_truncated(size_t block, size_t queries) override;
  TimeSpans add_times(size_t block, size_t queries) override;
  uint32_t* add_clamped(size_t block, size_t queries) override;
  uint32_t* add_unanchored(size_t block, size_t queries) override;

 private:
  v1::BlockResult& block(size_t index) { return *result_.mutable_blocks(static_cast<int>(index)); }

  v1::QueryResult& result_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONVERT_RESULT_COLUMNS_H_
