// The real locusd in a process of its own, which listens on a free port. The destructor kills the process.
#ifndef LOCUS_TESTS_SUPPORT_DAEMON_PROCESS_H_
#define LOCUS_TESTS_SUPPORT_DAEMON_PROCESS_H_

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/built_program.h"
#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text_of.h"

namespace locus::test {

class DaemonProcess : public ChildProcess {
 public:
  DaemonProcess(std::vector<std::string> arguments, const std::string& log)
      : ChildProcess(built_program("locusd"), std::move(arguments), log) {}

  // Returns the port that the daemon writes to its port file. If the daemon writes no port within a minute, fails the
  // test and returns 0.
  static int wait_for_port(const std::string& port_file) {
    for (int i = 0; i < 3000; ++i) {
      if (const std::string text = text_of(port_file); !text.empty()) return std::atoi(text.c_str());
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    ADD_FAILURE() << "no port in " << port_file;
    return 0;
  }
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_DAEMON_PROCESS_H_
