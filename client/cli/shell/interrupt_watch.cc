#include "client/cli/shell/interrupt_watch.h"

#include <ctime>
#include <utility>

namespace locus::cli {
namespace {

constexpr long kPollNanoseconds = 50'000'000;

sigset_t interrupt_only() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  return signals;
}

}  // namespace

InterruptWatch::InterruptWatch(std::function<void()> on_interrupt) : on_interrupt_(std::move(on_interrupt)) {
  const sigset_t signals = interrupt_only();
  pthread_sigmask(SIG_BLOCK, &signals, &before_);
  thread_ = std::thread([this] { run(); });
}

InterruptWatch::~InterruptWatch() {
  ended_ = true;
  thread_.join();
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

void InterruptWatch::run() {
  const sigset_t signals = interrupt_only();
  const timespec poll = {0, kPollNanoseconds};
  while (!ended_) {
    if (sigtimedwait(&signals, nullptr, &poll) == SIGINT) on_interrupt_();
  }
}

}  // namespace locus::cli
