#include "tests/bench/serving/query_load.h"

#include <atomic>
#include <utility>

#include "tests/bench/serving/threads.h"

namespace locus::bench::serving {
namespace {

// The batches that belong to one of `shares` workers, round and round: first, first + shares ...
class Share {
 public:
  Share(size_t first, size_t shares, size_t count) : first_(first), shares_(shares), count_(count), at_(first) {}
  size_t next() {
    const size_t batch = at_;
    at_ += shares_;
    if (at_ >= count_) at_ = first_;
    return batch;
  }
  // How many there are.
  size_t size() const { return (count_ - first_ + shares_ - 1) / shares_; }

 private:
  const size_t first_, shares_, count_;
  size_t at_;
};

}  // namespace

std::unique_ptr<QueryStreamLoad> open_query_stream(const LocalServer& server) {
  const auto stub = std::shared_ptr(v1::QueryService::NewStub(server.channel()));
  return std::make_unique<QueryStreamLoad>([stub](grpc::ClientContext* context, grpc::CompletionQueue* queue,
                                                  void* tag) { return stub->AsyncStreamQueries(context, queue, tag); });
}

void Batches::borrow() {
  columns.clear();
  for (const v1::StreamQueriesRequest& message : messages) columns.push_back(columns_of(message.batch()));
}

ServerLoad::ServerLoad(const LocalServer& server, Batches& batches, size_t streams, size_t window)
    : batches_(batches), window_(window) {
  for (size_t i = 0; i < streams; ++i) streams_.push_back(open_query_stream(server));
}

void ServerLoad::run(size_t passes) {
  Turns turns(passes * batches_.messages.size());
  std::vector<absl::Status> ends(streams_.size());
  std::atomic<size_t> refused = 0;
  on_threads(streams_.size(), [&](size_t stream) {
    Share share(stream, streams_.size(), batches_.messages.size());
    const auto next = [&](uint64_t& number) -> v1::StreamQueriesRequest* {
      if (!turns.take()) return nullptr;
      number = share.next();
      return &batches_.messages[number];
    };
    const auto reply = [&](uint64_t, const v1::StreamQueriesResponse& response, double) {
      if (!response.has_result()) ++refused;
    };
    ends[stream] = streams_[stream]->run(window_, next, reply);
  });
  for (const absl::Status& end : ends) status_.Update(end);
  if (refused != 0) status_.Update(absl::DataLossError(absl::StrCat(refused.load(), " batches were refused")));
}

std::vector<uint64_t> ServerLoad::hashes() {
  std::vector<uint64_t> hashes(batches_.messages.size());
  std::vector<absl::Status> ends(streams_.size());
  std::atomic<size_t> rows = 0;
  on_threads(streams_.size(), [&](size_t stream) {
    Share share(stream, streams_.size(), batches_.messages.size());
    size_t left = share.size();
    const auto next = [&](uint64_t& number) -> v1::StreamQueriesRequest* {
      if (left-- == 0) return nullptr;
      number = share.next();
      return &batches_.messages[number];
    };
    const auto reply = [&](uint64_t number, const v1::StreamQueriesResponse& response, double) {
      hashes[number] = hash_of(response.result());
      rows += rows_of(response.result());
    };
    ends[stream] = streams_[stream]->run(window_, next, reply);
  });
  for (const absl::Status& end : ends) status_.Update(end);
  rows_ = rows;
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
