#include "server/observability/process_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/un.h>

#include <chrono>
#include <vector>

#include "tests/support/http_get.h"

namespace locus::server {
namespace {

TEST(ProcessFiguresTest, EveryFigureOfTheProcessIsPositive) {
  const ProcessFigures process = read_process({});
  EXPECT_GT(process.cpu_seconds, 0);
  EXPECT_GT(process.resident_bytes, 1u << 20);
  EXPECT_GE(process.threads, 1u);
  EXPECT_GE(process.open_files, 3u);
  EXPECT_LE(process.open_files, process.max_files);
  const double now = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
  EXPECT_LT(process.start_seconds, now + 1);
  EXPECT_GT(process.start_seconds, now - 86400);
}

TEST(ProcessFiguresTest, ResidentMemoryGrowsWhenMemoryIsTouched) {
  const uint64_t before = resident_bytes();
  ASSERT_GT(before, 0u);
  const std::vector<char> touched(size_t{64} << 20, 'x');
  EXPECT_GT(resident_bytes(), before + touched.size() / 2);
}

TEST(ProcessFiguresTest, OnlyConnectionsToTheGivenAddressesAreCounted) {
  const int listening = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof name;
  ASSERT_EQ(bind(listening, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
  ASSERT_EQ(listen(listening, 2), 0);
  ASSERT_EQ(getsockname(listening, reinterpret_cast<sockaddr*>(&name), &length), 0);
  const int port = ntohs(name.sin_port);
  const std::string address = "127.0.0.1:" + std::to_string(port);
  EXPECT_EQ(read_process({address}).connections, 0u);
  {
    // The clients' sockets are in this process too, but have other local ports, so read_process() does not count them.
    const test::RawConnection first(port, "");
    const test::RawConnection second(port, "");
    const int accepted[] = {accept(listening, nullptr, nullptr), accept(listening, nullptr, nullptr)};
    EXPECT_EQ(read_process({address}).connections, 2u);
    EXPECT_EQ(read_process({"127.0.0.1:1", "nonsense"}).connections, 0u);
    for (const int fd : accepted) close(fd);
  }
  EXPECT_EQ(read_process({address}).connections, 0u);
  close(listening);
}

TEST(ProcessFiguresTest, ConnectionsToAUnixSocketAreCounted) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  const std::string path = testing::TempDir() + "locus-process-figures.sock";
  unlink(path.c_str());
  path.copy(name.sun_path, sizeof name.sun_path - 1);
  const int listening = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(bind(listening, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
  ASSERT_EQ(listen(listening, 1), 0);
  const int caller = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(connect(caller, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
  const int accepted = accept(listening, nullptr, nullptr);
  EXPECT_EQ(read_process({"unix:" + path}).connections, 1u);
  for (const int fd : {accepted, caller, listening}) close(fd);
  unlink(path.c_str());
}

}  // namespace
}  // namespace locus::server
