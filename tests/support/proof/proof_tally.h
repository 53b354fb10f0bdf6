// Runs the trials of a proof on all processors and adds their counts.
#ifndef LOCUS_TESTS_SUPPORT_PROOF_PROOF_TALLY_H_
#define LOCUS_TESTS_SUPPORT_PROOF_PROOF_TALLY_H_

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace locus::test {

struct ProofTally {
  // `found` is the number of rows, hits or other findings that were compared with the reference.
  uint64_t queries = 0, found = 0, faults = 0;
  std::string first_fault;

  void note(const std::string& fault) {
    if (faults++ == 0) first_fault = fault;
  }
  ProofTally& operator+=(const ProofTally& other) {
    queries += other.queries;
    found += other.found;
    faults += other.faults;
    if (first_fault.empty()) first_fault = other.first_fault;
    return *this;
  }
};

// Calls trial(i, tally) for each i below `trials`, on one thread for each processor, and returns the sum of the
// tallies. Calls for different i may run at the same time, with different tallies.
inline ProofTally run_trials(uint64_t trials, const std::function<void(uint64_t, ProofTally&)>& trial) {
  std::atomic<uint64_t> next{0};
  std::mutex mutex;
  ProofTally all;
  std::vector<std::thread> threads;
  for (unsigned thread = 0; thread < std::max(1u, std::thread::hardware_concurrency()); ++thread)
    threads.emplace_back([&] {
      ProofTally own;
      for (uint64_t i = next++; i < trials; i = next++) trial(i, own);
      const std::lock_guard lock(mutex);
      all += own;
    });
  for (std::thread& thread : threads) thread.join();
  return all;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_PROOF_TALLY_H_
