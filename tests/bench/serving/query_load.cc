#include "tests/bench/serving/query_load.h"

#include <utility>

#include "tests/bench/serving/threads.h"

namespace locus::bench::serving {
namespace {

// Indices of the batches of one of `shares` workers: first, first + shares ... below `count`, repeated in a cycle.
class Share {
 public:
  Share(size_t first, size_t shares, size_t count) : first_(first), shares_(shares), count_(count), at_(first) {}
  size_t next() {
    const size_t batch = at_;
    at_ += shares_;
    if (at_ >= count_) at_ = first_;
    return batch;
  }
  // Returns the number of batches of this share.
  size_t size() const { return (count_ - first_ + shares_ - 1) / shares_; }

 private:
  const size_t first_, shares_, count_;
  size_t at_;
};

}  // namespace

std::unique_ptr<QueryStreamLoad> open_query_streams(const LocalServer& server, size_t streams) {
  std::vector<QueryStreamLoad::Open> opens;
  for (size_t i = 0; i < streams; ++i) {
    const auto stub = std::shared_ptr(v1::QueryService::NewStub(server.channel()));
    opens.push_back([stub](grpc::ClientContext* context, grpc::CompletionQueue* queue, void* tag) {
      return stub->AsyncStreamQueries(context, queue, tag);
    });
  }
  return std::make_unique<QueryStreamLoad>(opens);
}

void Batches::borrow() {
  columns.clear();
  for (const v1::StreamQueriesRequest& message : messages) columns.push_back(columns_of(message.batch()));
}

ServerLoad::ServerLoad(const LocalServer& server, Batches& batches, size_t streams, size_t window)
    : batches_(batches), count_(streams), streams_(open_query_streams(server, streams)), window_(window) {}

void ServerLoad::run(size_t passes) {
  size_t left = passes * batches_.messages.size(), refused = 0;
  std::vector<QueryStreamLoad::Next> next;
  for (size_t stream = 0; stream < count_; ++stream)
    next.push_back([this, &left, share = Share(stream, count_, batches_.messages.size())](
                       uint64_t& number) mutable -> v1::StreamQueriesRequest* {
      if (left == 0) return nullptr;
      --left;
      number = share.next();
      return &batches_.messages[number];
    });
  const auto reply = [&](uint64_t, const v1::StreamQueriesResponse& response, double) {
    if (!response.has_result()) ++refused;
  };
  status_.Update(streams_->run(window_, next, reply));
  if (refused != 0) status_.Update(absl::DataLossError(absl::StrCat(refused, " batches were refused")));
}

std::vector<uint64_t> ServerLoad::hashes() {
  std::vector<uint64_t> hashes(batches_.messages.size());
  rows_ = 0;
  std::vector<QueryStreamLoad::Next> next;
  for (size_t stream = 0; stream < count_; ++stream) {
    Share share(stream, count_, batches_.messages.size());
    const size_t size = share.size();
    next.push_back([this, share, left = size](uint64_t& number) mutable -> v1::StreamQueriesRequest* {
      if (left == 0) return nullptr;
      --left;
      number = share.next();
      return &batches_.messages[number];
    });
  }
  const auto reply = [&](uint64_t number, const v1::StreamQueriesResponse& response, double) {
    hashes[number] = hash_of(response.result());
    rows_ += rows_of(response.result());
  };
  status_.Update(streams_->run(window_, next, reply));
  return hashes;
}

LocalLoad::LocalLoad(SnapshotPtr snapshot, const Batches& batches, size_t threads)
    : snapshot_(std::move(snapshot)), batches_(batches), threads_(threads) {}

void LocalLoad::run(size_t passes) const {
  Turns turns(passes * batches_.columns.size());
  on_threads(threads_, [&](size_t thread) {
    Share share(thread, threads_, batches_.columns.size());
    while (turns.take()) answer_here(*snapshot_, batches_.columns[share.next()]);
  });
}

std::vector<uint64_t> LocalLoad::hashes() const {
  std::vector<uint64_t> hashes;
  for (const QueryBatch& batch : batches_.columns) hashes.push_back(hash_of(answer_here(*snapshot_, batch)));
  return hashes;
}

}  // namespace locus::bench::serving
