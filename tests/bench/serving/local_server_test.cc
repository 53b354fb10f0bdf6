#include "tests/bench/serving/local_server.h"

#include <gtest/gtest.h>

#include "tests/bench/serving/echo_answer.h"
#include "tests/bench/serving/query_load.h"

namespace locus::bench::serving {
namespace {

TEST(LocalServerTest, AMissingProgramIsNamed) {
  const auto server = LocalServer::start("no-such-program");
  EXPECT_EQ(server.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_NE(server.status().message().find("no-such-program"), absl::string_view::npos);
}

Batches two_batches() {
  Batches batches;
  for (int i = 0; i < 2; ++i) {
    v1::StreamQueriesRequest& message = batches.messages.emplace_back();
    message.set_scene("echo");
    v1::QueryBlock& block = *message.mutable_batch()->add_blocks();
    for (int ray = 0; ray < 3; ++ray) {
      for (int axis = 0; axis < 3; ++axis) block.mutable_rays()->add_origins(static_cast<float>(i + ray + axis));
      block.mutable_rays()->add_t_max(static_cast<float>(10 * i + ray));
      block.add_masks(static_cast<uint32_t>(ray));
    }
  }
  return batches;
}

TEST(EchoTest, EveryBatchComesBackAsColumns) {
  const auto server = LocalServer::start("locus-echo");
  ASSERT_TRUE(server.ok()) << server.status();
  Batches batches = two_batches();
  std::vector<uint64_t> expected;
  for (const v1::StreamQueriesRequest& message : batches.messages) {
    v1::QueryResult result;
    answer_echo(message.batch(), result);
    expected.push_back(hash_of(result));
  }
  ServerLoad load(**server, batches, 2, 2);
  EXPECT_EQ(load.hashes(), expected);
  EXPECT_TRUE(load.status().ok()) << load.status();
}

TEST(EchoTest, AnAnswerHas24BytesARay) {
  const Batches batches = two_batches();
  v1::QueryResult result;
  answer_echo(batches.messages.front().batch(), result);
  const v1::BlockResult& block = result.blocks(0);
  EXPECT_EQ(4 * block.t_size() + 8 * block.ids_size() + 4 * block.triangles_size() + 4 * block.uvs_size(), 3 * 24);
}

}  // namespace
}  // namespace locus::bench::serving
