#include "client/lib/query_builder.h"

#include <utility>

namespace locus::client {

QueryBuilder& QueryBuilder::at_least(const Revision& revision) {
  batch_.mutable_view()->set_at_least(revision.revision);
  batch_.mutable_view()->set_epoch(revision.epoch);
  return *this;
}

QueryBuilder& QueryBuilder::exactly(const Revision& revision) {
  batch_.mutable_view()->set_exactly(revision.revision);
  batch_.mutable_view()->set_epoch(revision.epoch);
  return *this;
}

QueryBuilder& QueryBuilder::max_work(uint64_t work) {
  batch_.set_max_work(work);
  return *this;
}

QueryBuilder& QueryBuilder::explain() {
  batch_.set_explain(true);
  return *this;
}

QueryBuilder& QueryBuilder::by_list() {
  batch_.set_by_list(true);
  return *this;
}

QueryBuilder& QueryBuilder::max_reply_bytes(uint32_t bytes) {
  batch_.set_max_reply_bytes(bytes);
  return *this;
}

v1::QueryBatch QueryBuilder::build() { return std::exchange(batch_, v1::QueryBatch()); }

}  // namespace locus::client
