// Readers of snapshots run concurrently with the writer of a table. The test checks the values that the readers get;
// ThreadSanitizer detects data races.
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <thread>

#include "core/base/persistent_id_table.h"

namespace locus::test {
namespace {

constexpr Id kIds = 2'000;
constexpr int kReads = 50;

// Holder of the latest published snapshot, which threads exchange under a mutex.
class Published {
 public:
  void put(PersistentIdTable<> table) {
    const std::lock_guard lock(mutex_);
    std::swap(table_, table);  // the last owner of the previous snapshot, this thread or a reader, frees it
  }
  PersistentIdTable<> get() const {
    const std::lock_guard lock(mutex_);
    return table_;
  }

 private:
  mutable std::mutex mutex_;
  PersistentIdTable<> table_;
};

// The value of every id is the number of a generation. In each generation the writer replaces all values, some after
// erasing their ids, and publishes a snapshot. No snapshot may contain values of two generations.
TEST(PersistentIdTableTest, ReadersOfSnapshotsNeverSeeConcurrentWrites) {
  Published published;
  std::atomic<int> reads{0};
  const auto read = [&] {
    while (reads.load() < kReads) {
      const PersistentIdTable<> table = published.get();
      const uint32_t generation = table.find(1);
      for (Id id = 1; id <= table.size(); ++id) EXPECT_EQ(table.find(id), generation);
      if (table.size() == kIds) ++reads;
    }
  };
  std::thread first(read), second(read);
  PersistentIdTable<> table;
  for (uint32_t generation = 1; generation <= 10 || reads.load() < kReads; ++generation) {
    for (Id id = 1; id <= kIds; ++id) {
      if ((id + generation) % 7 == 0) table.erase(id);
      table.set(id, generation);
    }
    published.put(table.snapshot());
  }
  first.join();
  second.join();
  EXPECT_EQ(published.get().size(), kIds);
}

}  // namespace
}  // namespace locus::test
