// Functions that distribute calls over a given number of threads, for BvhOptions::parallel_for and run_batch(). The
// threads start and end with each call.
#ifndef LOCUS_TESTS_SUPPORT_THREADS_H_
#define LOCUS_TESTS_SUPPORT_THREADS_H_

#include <atomic>
#include <functional>
#include <thread>
#include <vector>

namespace locus::test {

using ParallelFor = std::function<void(size_t, const std::function<void(size_t)>&)>;

inline ParallelFor on_threads(size_t threads) {
  return [threads](size_t count, const std::function<void(size_t)>& work) {
    std::atomic<size_t> next = 0;
    const auto take = [&] {
      for (size_t i = next++; i < count; i = next++) work(i);
    };
    std::vector<std::thread> others;
    for (size_t i = 1; i < threads; ++i) others.emplace_back(take);
    take();
    for (std::thread& other : others) other.join();
  };
}

// Returns a function that makes the calls in descending order of their arguments, since the callers' results must not
// depend on the order.
inline ParallelFor backwards() {
  return [](size_t count, const std::function<void(size_t)>& work) {
    while (count-- > 0) work(count);
  };
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_THREADS_H_
