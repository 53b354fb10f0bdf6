// Features of the machine that some tests need. They are determined without the code under test, so that a fault of
// that code makes a test fail instead of being skipped. Free functions; any thread.
#ifndef LOCUS_TESTS_SUPPORT_MACHINE_FEATURES_H_
#define LOCUS_TESTS_SUPPORT_MACHINE_FEATURES_H_

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <string>

#include "absl/strings/match.h"

namespace locus::test {

// Returns whether a socket can listen on the IPv6 address [::1].
inline bool has_ipv6() {
  const int descriptor = socket(AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in6 address{};
  address.sin6_family = AF_INET6;
  address.sin6_addr = IN6ADDR_LOOPBACK_INIT;
  const bool bound =
      descriptor >= 0 && bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  if (descriptor >= 0) close(descriptor);
  return bound;
}

// Returns whether the kernel supports filters of system calls (seccomp) that kill a process which makes a forbidden
// call.
inline bool kernel_filters_system_calls() {
  std::ifstream file("/proc/sys/kernel/seccomp/actions_avail");
  const std::string actions(std::istreambuf_iterator<char>(file), {});
  return absl::StrContains(actions, "kill_process");
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_MACHINE_FEATURES_H_
