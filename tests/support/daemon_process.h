// The real locusd in a process of its own, on a free port, ended with the test.
#ifndef LOCUS_TESTS_SUPPORT_DAEMON_PROCESS_H_
#define LOCUS_TESTS_SUPPORT_DAEMON_PROCESS_H_

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temporary_folder.h"

namespace locus::test {

inline std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

class DaemonProcess {
 public:
  // `log` takes what the daemon writes to standard output and standard error.
  DaemonProcess(std::vector<std::string> arguments, const std::string& log) {
    arguments.insert(arguments.begin(), LOCUS_DAEMON);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
    if (posix_spawn(&pid_, LOCUS_DAEMON, &actions, nullptr, argv.data(), environ) != 0) {
      ADD_FAILURE() << "cannot start " << LOCUS_DAEMON;
      pid_ = 0;
    }
    posix_spawn_file_actions_destroy(&actions);
  }
  ~DaemonProcess() {
    if (pid_ == 0) return;
    kill(pid_, SIGKILL);
    wait();
  }
  DaemonProcess(const DaemonProcess&) = delete;
  DaemonProcess& operator=(const DaemonProcess&) = delete;

  void signal(int number) { kill(pid_, number); }

  // Its exit code once it has ended; -1 if a signal ended it.
  int wait() {
    int status = 0;
    if (pid_ == 0 || waitpid(pid_, &status, 0) != pid_) return -1;
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  // The port that it writes to its port file; 0, and a failure, if none comes.
  static int wait_for_port(const std::string& port_file) {
    for (int i = 0; i < 3000; ++i) {
      if (const std::string text = text_of(port_file); !text.empty()) return std::atoi(text.c_str());
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    ADD_FAILURE() << "no port in " << port_file;
    return 0;
  }

 private:
  pid_t pid_ = 0;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_DAEMON_PROCESS_H_
