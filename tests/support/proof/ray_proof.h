// The proof that no ray misses, as a run of any number of rays. Equal seeds give equal rays, on any number of threads
// and any processor; each ray is traced by one of the processor's instruction sets.
#ifndef LOCUS_TESTS_SUPPORT_PROOF_RAY_PROOF_H_
#define LOCUS_TESTS_SUPPORT_PROOF_RAY_PROOF_H_

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/index/bvh/kernels/dispatch.h"
#include "tests/support/proof/proof_rays.h"
#include "tests/support/proof/ray_judge.h"
#include "tests/support/proof/ray_repeats.h"

namespace locus::test {

namespace internal {

inline constexpr size_t kBlockRays = 2'000;

}  // namespace internal

class RayProof {
 public:
  RayProof(uint64_t rays, uint64_t seed, unsigned threads)
      : blocks_((rays + internal::kBlockRays - 1) / internal::kBlockRays), seed_(seed), threads_(threads) {}

  // Runs the proof. Afterwards the widest instruction set is selected.
  RayTally run() {
    for (uint64_t begin = 0; begin < blocks_; begin += kRoundBlocks) {
      scenes_ = proof_scenes(seed_ + begin);
      run_round(begin, std::min(kRoundBlocks, blocks_ - begin));
    }
    LOCUS_CHECK(use_instruction_set("").ok());
    return tally_;
  }

  // Returns the result of the run in one line.
  std::string line() const {
    return absl::StrFormat(
        "proof: %d rays, %d hits, %d misses, %d false hits, %d undecidable within the allowance; "
        "%d repeats, %d differing; instruction sets %s; seed %d",
        tally_.rays, tally_.hits, tally_.misses, tally_.false_hits, tally_.undecidable, tally_.repeats,
        tally_.differing_repeats, absl::StrJoin(instruction_sets(), ", "), seed_);
  }

 private:
  static constexpr uint64_t kRoundBlocks = 5'000;  // number of blocks after which new scenes are generated
  // Number of shares into which the blocks of a round are divided. The portable code processes at least one share; the
  // other shares are divided about equally among the instruction sets that have kernels.
  static constexpr uint64_t kShares = 8;
  static uint64_t share_before(size_t set, size_t sets) {
    if (set == sets) return kShares;
    return sets == 1 ? 0 : (kShares - 1) * set / (sets - 1);
  }

  // Runs `count` blocks, divided among the instruction sets.
  void run_round(uint64_t begin, uint64_t count) {
    const std::vector<std::string> sets = instruction_sets();
    for (size_t i = 0; i < sets.size(); ++i) {
      LOCUS_CHECK(use_instruction_set(sets[i]).ok());
      run_blocks(begin + count * share_before(i, sets.size()) / kShares,
                 begin + count * share_before(i + 1, sets.size()) / kShares, sets[i]);
    }
  }

  void run_blocks(uint64_t begin, uint64_t end, const std::string& set) {
    std::atomic<uint64_t> next{begin};
    const auto work = [&] {
      for (uint64_t block; (block = next++) < end;) {
        const RayTally part = run_one(block);
        const std::lock_guard<std::mutex> lock(mutex_);
        tally_.add(part);
        show_progress(set);
      }
    };
    std::vector<std::thread> others;
    for (unsigned i = 1; i < threads_; ++i) others.emplace_back(work);
    work();
    for (std::thread& other : others) other.join();
  }

  RayTally run_one(uint64_t block) const {
    Random random(seed_ * 0x9E3779B97F4A7C15u + block);
    random = Random(random.next());
    const ProofScene& scene = scenes_[block % scenes_.size()];
    const OwnedBlock rays = proof_rays(scene, internal::kBlockRays, random);
    const BlockResult first = run_block(*scene.snapshot, rays);
    RayTally tally = judge_first_hits(scene, rays, first);
    tally.add(repeat_rays(scene, rays, first, random));
    for (std::string& fault : tally.faults) fault = absl::StrFormat("block %d: %s", block, fault);
    return tally;
  }

  void show_progress(const std::string& set) {
    const auto now = std::chrono::steady_clock::now();
    if (now - shown_ < std::chrono::seconds(10)) return;
    shown_ = now;
    std::fprintf(stderr, "%s: %llu of %llu rays, %llu misses, %llu false hits\n", set.c_str(),
                 static_cast<unsigned long long>(tally_.rays),
                 static_cast<unsigned long long>(blocks_ * internal::kBlockRays),
                 static_cast<unsigned long long>(tally_.misses), static_cast<unsigned long long>(tally_.false_hits));
  }

  const uint64_t blocks_, seed_;
  const unsigned threads_;
  std::vector<ProofScene> scenes_;
  std::mutex mutex_;
  RayTally tally_;
  std::chrono::steady_clock::time_point shown_ = std::chrono::steady_clock::now();
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_PROOF_RAY_PROOF_H_
