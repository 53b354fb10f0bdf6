#include "tests/bench/serving/raw_tcp.h"

#include <gtest/gtest.h>

namespace locus::bench::serving {
namespace {

TEST(RawTcpTest, EveryMessageIsAnsweredOverEveryConnection) {
  const auto server = RawTcpServer::start();
  ASSERT_TRUE(server.ok()) << server.status();
  RawTcpLoad load(**server, {100'000, 3'000'000}, 2, 4);  // more than the sockets' buffers hold
  load.run(20);
  load.run(1);
  EXPECT_TRUE(load.status().ok()) << load.status();
}

TEST(RawTcpTest, AServerThatHasEndedIsAnErrorNotAHang) {
  auto server = RawTcpServer::start();
  ASSERT_TRUE(server.ok()) << server.status();
  RawTcpLoad load(**server, {100, 100}, 1, 2);
  load.run(10);
  ASSERT_TRUE(load.status().ok()) << load.status();
  server->reset();
  load.run(10);
  EXPECT_FALSE(load.status().ok());
}

}  // namespace
}  // namespace locus::bench::serving
