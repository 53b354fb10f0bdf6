#include "server/scheduling/allocator_use.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <vector>

#include "core/base/sanitized_build.h"

namespace locus::server {
namespace {

// Allocations that are too small for mappings of their own, so that the allocator keeps their memory when they end.
using Blocks = std::vector<std::unique_ptr<char[]>>;

constexpr size_t kBlock = size_t{64} << 10;
constexpr size_t kCount = 1024;
constexpr uint64_t kSum = kBlock * kCount;

AllocatorUse use_now() {
  uint64_t mapped = 0, resident = 0;  // in pages
  std::ifstream("/proc/self/statm") >> mapped >> resident;
  return allocator_use(resident * static_cast<uint64_t>(sysconf(_SC_PAGESIZE)));
}

TEST(AllocatorUseTest, FreedMemoryIsReusableUntilItIsReturned) {
  if (kSanitizedBuild) GTEST_SKIP() << "a sanitizer replaces the allocator";
  const AllocatorUse before = use_now();
  Blocks blocks;
  for (size_t i = 0; i < kCount; ++i) {
    blocks.push_back(std::make_unique<char[]>(kBlock));
    std::fill_n(blocks.back().get(), kBlock, 'x');
  }
  const AllocatorUse allocated = use_now();
  EXPECT_GE(allocated.live, before.live + kSum);
  blocks.erase(blocks.begin(), blocks.end() - 1);  // the last block stays, so that the heap cannot shrink from its end
  const AllocatorUse freed = use_now();
  EXPECT_LT(freed.live, allocated.live - kSum / 2);
  EXPECT_GT(freed.reusable, allocated.reusable + kSum / 2);
  return_free_memory();
  EXPECT_LT(use_now().reusable, freed.reusable - kSum / 2);
}

}  // namespace
}  // namespace locus::server
