// Ctrl-C (SIGINT) while a command of the shell runs: a thread takes the signal and calls a function.
#ifndef LOCUS_CLIENT_CLI_SHELL_INTERRUPT_WATCH_H_
#define LOCUS_CLIENT_CLI_SHELL_INTERRUPT_WATCH_H_

#include <atomic>
#include <csignal>
#include <functional>
#include <thread>

namespace locus::cli {

// Must be created before the process starts other threads, which inherit that SIGINT is blocked. Otherwise the signal
// could end the process.
class InterruptWatch {
 public:
  // Calls `on_interrupt` in a thread of this object for each SIGINT.
  explicit InterruptWatch(std::function<void()> on_interrupt);
  // Ends the thread, and unblocks SIGINT in the calling thread if it was not blocked before.
  ~InterruptWatch();
  InterruptWatch(const InterruptWatch&) = delete;
  InterruptWatch& operator=(const InterruptWatch&) = delete;

 private:
  void run();

  const std::function<void()> on_interrupt_;
  std::atomic<bool> ended_ = false;
  sigset_t before_;
  std::thread thread_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SHELL_INTERRUPT_WATCH_H_
