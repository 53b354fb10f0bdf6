// Ctrl-C (SIGINT), SIGTERM and SIGHUP while a command has something to clean up: instead of ending the process, the
// signals call a function until the object is destroyed, so that calls in progress can be cancelled. The shell, which
// blocks SIGINT, still handles it itself. One object at a time.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TUNE_CANCEL_ON_SIGNAL_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TUNE_CANCEL_ON_SIGNAL_H_

#include <array>
#include <atomic>
#include <csignal>
#include <functional>
#include <thread>

namespace locus::cli {

class CancelOnSignal {
 public:
  // After a signal, calls `cancel` every 50 ms in a thread of this object, so that it also cancels a call that begins
  // meanwhile.
  explicit CancelOnSignal(std::function<void()> cancel);
  // Ends the thread, and restores what the signals did before.
  ~CancelOnSignal();
  CancelOnSignal(const CancelOnSignal&) = delete;
  CancelOnSignal& operator=(const CancelOnSignal&) = delete;

  // Returns whether a signal has arrived.
  bool is_cancelled() const;

 private:
  static constexpr std::array<int, 3> kSignals = {SIGINT, SIGTERM, SIGHUP};

  void run();

  const std::function<void()> cancel_;
  std::atomic<bool> ended_ = false;
  std::array<struct sigaction, kSignals.size()> before_{};
  std::thread thread_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TUNE_CANCEL_ON_SIGNAL_H_
