#include "server/connections/listening_socket.h"

#include <gmock/gmock.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "absl/strings/str_cat.h"
#include "tests/support/raw_socket.h"
#include "tests/support/temporary_folder.h"

namespace locus::server {
namespace {

using test::RawSocket;
using ::testing::HasSubstr;

ListenAddress address_of(const std::string& text) { return *parse_listen_address(text); }

class ListeningSocketTest : public ::testing::Test {
 protected:
  ListenAddress unix_address() const { return address_of("unix:" + path_); }

  test::TemporaryFolder folder_;
  const std::string path_ = folder_.file("socket");
};

TEST_F(ListeningSocketTest, Port0IsAFreePortAndASecondListenerThereIsRefused) {
  const auto sockets = listen_on(address_of("127.0.0.1:0"), {});
  ASSERT_TRUE(sockets.ok()) << sockets.status();
  ASSERT_EQ(sockets->size(), 1u);
  const uint16_t port = sockets->front().port();
  EXPECT_GT(port, 0);
  EXPECT_TRUE(RawSocket(port).connected());
  const auto second = listen_on(address_of("127.0.0.1:" + std::to_string(port)), {});
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("another server runs there"));
}

TEST_F(ListeningSocketTest, AllAddressesOfAHostNameGetTheSamePort) {
  const auto sockets = listen_on(address_of("localhost:0"), {});
  ASSERT_TRUE(sockets.ok()) << sockets.status();
  for (const ListeningSocket& listening : *sockets) EXPECT_EQ(listening.port(), sockets->front().port());
}

TEST_F(ListeningSocketTest, AnUnknownHostIsNamed) {
  const auto sockets = listen_on(address_of("no-such-host.invalid:1"), {});
  EXPECT_THAT(std::string(sockets.status().message()), HasSubstr("the host is not known"));
}

TEST_F(ListeningSocketTest, AUnixSocketHasItsPermissionsAndIsRemovedAtTheEnd) {
  {
    const auto sockets = listen_on(unix_address(), {.mode = 0640, .owner = ""});
    ASSERT_TRUE(sockets.ok()) << sockets.status();
    struct stat file {};
    ASSERT_EQ(stat(path_.c_str(), &file), 0);
    EXPECT_EQ(file.st_mode & 0777, 0640u);
    EXPECT_TRUE(sockets->front().local());
    EXPECT_TRUE(RawSocket(path_).connected());
  }
  EXPECT_NE(access(path_.c_str(), F_OK), 0);
}

TEST_F(ListeningSocketTest, TheOwnerIsGivenByNameOrNumberAndUnknownOnesAreNamed) {
  EXPECT_TRUE(listen_on(unix_address(), {.owner = absl::StrCat(getuid())}).ok());
  EXPECT_TRUE(listen_on(unix_address(), {.owner = absl::StrCat(":", getgid())}).ok());
  const auto unknown = listen_on(unix_address(), {.owner = "no-such-user"});
  EXPECT_THAT(std::string(unknown.status().message()), HasSubstr("no-such-user"));
  EXPECT_NE(access(path_.c_str(), F_OK), 0);
}

TEST_F(ListeningSocketTest, TheSocketOfARunningProcessIsNotReplaced) {
  const auto first = listen_on(unix_address(), {});
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(listen_on(unix_address(), {}).status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_TRUE(RawSocket(path_).connected());
}

TEST_F(ListeningSocketTest, TheSocketOfAnEndedProcessIsReplaced) {
  const int left = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  std::strncpy(name.sun_path, path_.c_str(), sizeof(name.sun_path) - 1);
  ASSERT_EQ(bind(left, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
  close(left);
  EXPECT_TRUE(listen_on(unix_address(), {}).ok());
}

TEST_F(ListeningSocketTest, AFileThatIsNoSocketIsNeitherReplacedNorRemoved) {
  std::ofstream(path_) << "text";
  EXPECT_THAT(std::string(listen_on(unix_address(), {}).status().message()), HasSubstr("not a socket"));
  EXPECT_EQ(access(path_.c_str(), F_OK), 0);
}

TEST_F(ListeningSocketTest, AFileThatReplacedTheSocketIsNotRemoved) {
  auto sockets = listen_on(unix_address(), {});
  ASSERT_TRUE(sockets.ok());
  std::ofstream(folder_.file("other")) << "text";
  ASSERT_EQ(rename(folder_.file("other").c_str(), path_.c_str()), 0);
  sockets->clear();
  EXPECT_EQ(access(path_.c_str(), F_OK), 0);
}

TEST_F(ListeningSocketTest, AMissingFolderIsNamed) {
  const auto sockets = listen_on(address_of("unix:" + folder_.file("gone/socket")), {});
  EXPECT_THAT(std::string(sockets.status().message()), HasSubstr("/gone/"));
}

}  // namespace
}  // namespace locus::server
