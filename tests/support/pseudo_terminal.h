// Child process on a pseudo terminal, for tests of programs that people type into. Reads what the program shows, and
// types. Not thread-safe.
#ifndef LOCUS_TESTS_SUPPORT_PSEUDO_TERMINAL_H_
#define LOCUS_TESTS_SUPPORT_PSEUDO_TERMINAL_H_

#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "core/base/check.h"

namespace locus::test {

class PseudoTerminal {
 public:
  // Starts the program `arguments`[0] with `environment` (NAME=VALUE) added in front of that of this process.
  PseudoTerminal(std::vector<std::string> arguments, std::vector<std::string> environment) {
    // A child of a process with several threads must not allocate memory before it runs the program.
    for (char** variable = environ; *variable != nullptr; ++variable) environment.emplace_back(*variable);
    const std::vector<char*> words = pointers(arguments);
    const std::vector<char*> variables = pointers(environment);
    winsize size = {.ws_row = 50, .ws_col = 200, .ws_xpixel = 0, .ws_ypixel = 0};
    pid_ = forkpty(&terminal_, nullptr, nullptr, &size);
    LOCUS_CHECK(pid_ >= 0);
    if (pid_ != 0) return;
    execve(words[0], words.data(), variables.data());
    _exit(127);
  }
  ~PseudoTerminal() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    close(terminal_);
  }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  void type(const std::string& text) {
    LOCUS_CHECK_EQ(write(terminal_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }

  // Reads until the output since the last call contains `text`; then returns this output up to the end of `text`, and
  // drops it. Returns everything read if the program ends or nothing comes for a minute.
  std::string read_until(const std::string& text) {
    while (true) {
      if (const size_t found = shown_.find(text); found != std::string::npos) {
        std::string taken = shown_.substr(0, found + text.size());
        shown_.erase(0, taken.size());
        return taken;
      }
      if (!read_more()) return std::exchange(shown_, "");
    }
  }

  // Reads until the program ends. Returns its exit code, or -1 if a signal ended it or it did not end in a minute.
  int wait() {
    while (read_more()) {
    }
    int status = 0;
    for (int i = 0; i < 6000; ++i) {
      if (waitpid(pid_, &status, WNOHANG) == pid_) {
        pid_ = -1;
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
      }
      usleep(10'000);
    }
    return -1;
  }

 private:
  // Returns pointers to the texts, and a null pointer behind them.
  static std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> pointers;
    for (std::string& text : texts) pointers.push_back(text.data());
    pointers.push_back(nullptr);
    return pointers;
  }

  bool read_more() {
    constexpr int kPatienceMs = 60'000;
    pollfd wanted = {terminal_, POLLIN, 0};
    if (poll(&wanted, 1, kPatienceMs) <= 0) return false;
    char bytes[4096];
    const ssize_t size = read(terminal_, bytes, sizeof bytes);
    if (size <= 0) return false;  // the program ended
    shown_.append(bytes, static_cast<size_t>(size));
    return true;
  }

  pid_t pid_ = -1;
  int terminal_ = -1;
  std::string shown_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PSEUDO_TERMINAL_H_
