#include "tests/bench/serving/guests.h"

#include <gtest/gtest.h>

#include "tests/bench/serving/local_server.h"

namespace locus::bench::serving {
namespace {

v1::StreamQueriesRequest one_ray() {
  v1::StreamQueriesRequest message;
  message.set_scene("echo");
  v1::QueryBlock& block = *message.mutable_batch()->add_blocks();
  for (int axis = 0; axis < 3; ++axis) block.mutable_rays()->add_origins(0);
  block.mutable_rays()->add_t_max(1);
  block.add_masks(1);
  return message;
}

TEST(BulkCallerTest, IsAnswered) {
  const auto server = LocalServer::start("locus-echo");
  ASSERT_TRUE(server.ok()) << server.status();
  BulkCaller caller((*server)->address(), 3, one_ray());
  caller.run();
  caller.run();
  EXPECT_TRUE(caller.status().ok()) << caller.status();
}

TEST(ChurnTest, AllGuestsAreAnsweredAndLeave) {
  const auto server = LocalServer::start("locus-echo");
  ASSERT_TRUE(server.ok()) << server.status();
  const v1::StreamQueriesRequest message = one_ray();
  Churn guests((*server)->address(), 5, message);
  guests.run(20);
  EXPECT_TRUE(guests.status().ok()) << guests.status();
}

TEST(ChurnTest, UnansweredGuestsAreAnError) {
  const auto server = LocalServer::start("locus-echo");
  ASSERT_TRUE(server.ok()) << server.status();
  v1::StreamQueriesRequest message = one_ray();
  message.mutable_batch()->mutable_blocks(0)->add_masks(1);  // invalid: more masks than rays
  Churn guests((*server)->address(), 5, message);
  guests.run(20);
  EXPECT_FALSE(guests.status().ok());
}

TEST(SilentReadersTest, GetStuck) {
  const auto server = LocalServer::start("locus-echo");
  ASSERT_TRUE(server.ok()) << server.status();
  v1::StreamQueriesRequest message = one_ray();
  v1::QueryBlock& block = *message.mutable_batch()->mutable_blocks(0);
  block.mutable_rays()->mutable_origins()->Resize(3 * 8192, 1);
  block.mutable_rays()->mutable_t_max()->Resize(8192, 1);
  block.mutable_masks()->Resize(8192, 1);
  SilentReaders guests((*server)->address(), 2, message);
  guests.write_until_stuck();  // returns, since flow control stops the writers
}

}  // namespace
}  // namespace locus::bench::serving
