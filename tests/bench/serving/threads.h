// Distribution of work among the threads of a load. For loads with several connections.
#ifndef LOCUS_TESTS_BENCH_SERVING_THREADS_H_
#define LOCUS_TESTS_BENCH_SERVING_THREADS_H_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <vector>

namespace locus::bench::serving {

// Runs fn(0) ... fn(count - 1), each on a thread of its own, the first on this one; returns when all have ended.
template <class Fn>
void on_threads(size_t count, const Fn& fn) {
  std::vector<std::thread> threads;
  for (size_t i = 1; i < count; ++i) threads.emplace_back([&fn, i] { fn(i); });
  fn(size_t{0});
  for (std::thread& thread : threads) thread.join();
}

// A number of turns shared by all threads. Any thread.
class Turns {
 public:
  explicit Turns(size_t turns) : left_(static_cast<int64_t>(turns)) {}
  bool take() { return left_.fetch_sub(1, std::memory_order_relaxed) > 0; }

 private:
  std::atomic<int64_t> left_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_THREADS_H_
