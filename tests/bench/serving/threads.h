// Distribution of work among the threads of a load. Used by loads with several connections.
#ifndef LOCUS_TESTS_BENCH_SERVING_THREADS_H_
#define LOCUS_TESTS_BENCH_SERVING_THREADS_H_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

namespace locus::bench::serving {

// Runs fn(0) ... fn(count - 1) at the same time: fn(0) on this thread, each of the others on a new thread. Returns when
// all have ended.
template <class Fn>
void on_threads(size_t count, const Fn& fn) {
  std::vector<std::thread> threads;
  for (size_t i = 1; i < count; ++i) threads.emplace_back([&fn, i] { fn(i); });
  fn(size_t{0});
  for (std::thread& thread : threads) thread.join();
}

// A counter of remaining turns that threads share: take() returns true once for each turn. Any thread may call it.
class Turns {
 public:
  explicit Turns(size_t turns) : left_(static_cast<int64_t>(turns)) {}
  bool take() { return left_.fetch_sub(1, std::memory_order_relaxed) > 0; }

 private:
  std::atomic<int64_t> left_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_THREADS_H_
