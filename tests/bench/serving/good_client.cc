#include "tests/bench/serving/good_client.h"

#include <utility>

namespace locus::bench::serving {

GoodClient::GoodClient(const ServingRun& run, TwinScene& scene, const std::string& case_name, Batches batches)
    : run_(run),
      case_name_(case_name),
      batches_(std::move(batches)),
      expected_(LocalLoad(scene.here().latest(), batches_, 1).hashes()),
      stream_(open_query_streams(scene.daemon(), 1)) {}

void GoodClient::ask(size_t count, std::vector<double>& seconds) {
  size_t sent = 0, wrong = 0;
  const auto next = [&](uint64_t& number) -> v1::StreamQueriesRequest* {
    if (sent == count) return nullptr;
    number = sent++ % batches_.messages.size();
    return &batches_.messages[number];
  };
  const auto reply = [&](uint64_t number, const v1::StreamQueriesResponse& response, double took) {
    seconds.push_back(took);
    if (hash_of(response.result()) != expected_[number]) ++wrong;
  };
  status_.Update(stream_->run(1, next, reply));
  if (wrong != 0) run_.disagree(absl::StrCat(case_name_, ": ", wrong, " batches have other answers over gRPC"));
}

}  // namespace locus::bench::serving
