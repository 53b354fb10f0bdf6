// Example of an embedded server: asks batches of 1,024 rays and prints the time of a batch. With the address of a
// locusd it asks the same batches there, by turns, and compares the times and the answers.
//
//   embedded_rays [ADDRESS]
//
// The exit code is 1 if an answer differs or a call fails.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <deque>
#include <future>
#include <iostream>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/string_view.h"
#include "client/embedded/embedded_server.h"
#include "client/lib/query_builder.h"
#include "client/lib/update_builder.h"

namespace locus::client {
namespace {

constexpr char kScene[] = "embedded-rays";
constexpr char kEmptyScene[] = "embedded-rays-empty";  // shows the cost of the messages alone
constexpr uint64_t kBalls = 20'000;
constexpr size_t kRays = 1024;
constexpr int kRounds = 15;
constexpr int kBatchesARound = 40;
constexpr size_t kInFlight = 4;

// Random number generators with a fixed seed, so that all servers get the same balls and rays.
class Places {
 public:
  explicit Places(unsigned int seed) : random_(seed) {}
  Float3 next() { return {place_(random_), place_(random_), place_(random_)}; }

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<float> place_{-50, 50};
};

absl::Status fill(const Client& client) {
  absl::Status status;
  for (const char* const name : {kScene, kEmptyScene}) {
    v1::CreateSceneRequest request;
    request.set_name(name);
    status.Update(client.create_scene(request).status());
  }
  Places places(1);
  UpdateBuilder updates;
  for (uint64_t id = 1; id <= kBalls; ++id) updates.insert_ball(id, places.next(), 0.5f);
  if (status.ok()) status = client.apply(kScene, updates.build()).status();
  return status;
}

v1::QueryBatch rays() {
  Places places(2);
  QueryBuilder queries;
  RayBlock block = queries.rays();
  for (size_t i = 0; i < kRays; ++i) block.ray(places.next(), places.next());
  return queries.build();
}

// Returns the serialized result blocks; they do not contain the scene's epoch, which is random. Empty after an error.
std::string answer_of(const absl::StatusOr<v1::QueryResult>& result) {
  if (!result.ok()) std::cerr << result.status() << "\n";
  std::string bytes;
  if (result.ok())
    for (const v1::BlockResult& block : result->blocks()) bytes += block.SerializeAsString();
  return bytes;
}

// A server and the times of its batches in microseconds.
struct Contestant {
  const char* name;
  std::unique_ptr<Client> client;
  std::vector<double> unary, stream, empty;

  void run_round() {
    const auto microseconds = [](auto since) {
      return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - since).count() /
             kBatchesARound;
    };
    const v1::QueryBatch batch = rays();
    auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < kBatchesARound; ++i) client->query(kScene, batch).status().IgnoreError();
    unary.push_back(microseconds(begin));
    begin = std::chrono::steady_clock::now();
    for (int i = 0; i < kBatchesARound; ++i) client->query(kEmptyScene, batch).status().IgnoreError();
    empty.push_back(microseconds(begin));
    const std::unique_ptr<QueryStream> batches = client->query_stream(kScene, {.max_in_flight = kInFlight});
    begin = std::chrono::steady_clock::now();
    for (int i = 0; i < kBatchesARound; ++i) batches->send(batch, [](const auto&) {}).IgnoreError();
    batches->flush().IgnoreError();
    stream.push_back(microseconds(begin));
  }
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

int run(std::vector<Contestant>& contestants) {
  std::string wanted;
  for (const Contestant& one : contestants) {
    if (const absl::Status filled = fill(*one.client); !filled.ok()) return std::cerr << filled << "\n", 1;
    const std::string answer = answer_of(one.client->query(kScene, rays()));
    if (wanted.empty()) wanted = answer;
    if (answer.empty() || answer != wanted) return std::cerr << one.name << ": the answers differ\n", 1;
  }
  for (int round = 0; round < kRounds; ++round)
    for (Contestant& one : contestants) one.run_round();
  std::printf("microseconds for a batch of %zu rays, medians of %d rounds; answers are equal\n", kRays, kRounds);
  std::printf("server    one_call  stream_of_%zu  empty_scene\n", kInFlight);
  for (const Contestant& one : contestants)
    std::printf("%-8s  %8.0f  %11.0f  %11.0f\n", one.name, median(one.unary), median(one.stream), median(one.empty));
  for (const Contestant& one : contestants) {
    for (const char* const name : {kScene, kEmptyScene}) {
      v1::DeleteSceneRequest gone;
      gone.set_name(name);
      one.client->delete_scene(gone).IgnoreError();
    }
  }
  return 0;
}

}  // namespace
}  // namespace locus::client

int main(int argc, char** argv) {
  using locus::client::Client;
  const auto server = locus::client::EmbeddedServer::start();
  if (!server.ok()) return std::cerr << server.status() << "\n", 1;
  std::vector<locus::client::Contestant> contestants;
  contestants.push_back({"embedded", (*server)->connect(), {}, {}, {}});
  if (argc > 1) {
    auto client = Client::connect(argv[1]);
    if (!client.ok()) return std::cerr << client.status() << "\n", 1;
    contestants.push_back({"daemon", *std::move(client), {}, {}, {}});
  }
  return locus::client::run(contestants);
}
