#include "tests/bench/serving/newcomers.h"

#include <atomic>
#include <chrono>

#include "tests/bench/serving/threads.h"

namespace locus::bench::serving {
namespace {

constexpr size_t kAtTheSameTime = 4;

}  // namespace

Newcomers::Newcomers(const Daemon& daemon, const Batches& batches) : daemon_(daemon) {
  for (const v1::StreamQueriesRequest& message : batches.messages) {
    v1::QueryRequest& request = requests_.emplace_back();
    request.set_scene(message.scene());
    *request.mutable_batch() = message.batch();
  }
}

void Newcomers::run(size_t count) {
  std::atomic<size_t> arrived = 0;
  std::vector<absl::Status> ends(kAtTheSameTime);
  on_threads(kAtTheSameTime, [&](size_t thread) {
    for (size_t i = arrived++; i < count && ends[thread].ok(); i = arrived++)
      ends[thread] = come(i % requests_.size(), nullptr);
  });
  for (const absl::Status& end : ends) status_.Update(end);
}

std::vector<uint64_t> Newcomers::hashes() {
  std::vector<uint64_t> hashes(requests_.size());
  for (size_t i = 0; i < requests_.size(); ++i) status_.Update(come(i, &hashes[i]));
  return hashes;
}

// Connects, sends the batch with index `batch` and disconnects after the answer. Sets `hash`, if it is not null, to a
// hash of the answer.
absl::Status Newcomers::come(size_t batch, uint64_t* hash) const {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kSilence);
  v1::QueryResponse response;
  const grpc::Status status =
      v1::QueryService::NewStub(daemon_.channel())->Query(&context, requests_[batch], &response);
  if (!status.ok()) return failed(status);
  if (hash != nullptr) *hash = hash_of(response.result());
  return absl::OkStatus();
}

}  // namespace locus::bench::serving
