#include "client/cli/extras/tune/cancel_on_signal.h"

#include <chrono>
#include <utility>

namespace locus::cli {
namespace {

constexpr std::chrono::milliseconds kPoll(50);

// The handler may only touch a lock-free atomic.
std::atomic<bool> signalled = false;
static_assert(std::atomic<bool>::is_always_lock_free);

void on_signal(int) { signalled = true; }

}  // namespace

CancelOnSignal::CancelOnSignal(std::function<void()> cancel) : cancel_(std::move(cancel)) {
  signalled = false;
  struct sigaction action = {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (size_t i = 0; i < kSignals.size(); ++i) {
    sigaction(kSignals[i], &action, &before_[i]);
    if (before_[i].sa_handler == SIG_IGN) sigaction(kSignals[i], &before_[i], nullptr);  // as nohup wants it
  }
  thread_ = std::thread([this] { run(); });
}

CancelOnSignal::~CancelOnSignal() {
  ended_ = true;
  thread_.join();
  for (size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &before_[i], nullptr);
}

bool CancelOnSignal::is_cancelled() const { return signalled; }

void CancelOnSignal::run() {
  while (!ended_) {
    std::this_thread::sleep_for(kPoll);
    if (signalled) cancel_();
  }
}

}  // namespace locus::cli
