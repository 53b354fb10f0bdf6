// Readers of snapshots concurrent with the writer of a table: checks their values, and data races under
// ThreadSanitizer.
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <thread>

#include "core/base/persistent_id_table.h"

namespace locus::test {
namespace {

constexpr Id kIds = 2'000;
constexpr int kReads = 50;

// Latest published snapshot.
class Published {
 public:
  void put(PersistentIdTable<> table) {
    const std::lock_guard lock(mutex_);
    std::swap(table_, table);  // frees the previous snapshot here or in a reader
  }
  PersistentIdTable<> get() const {
    const std::lock_guard lock(mutex_);
    return table_;
  }

 private:
  mutable std::mutex mutex_;
  PersistentIdTable<> table_;
};

// The writer replaces all values of a generation by the next, some after erasing their ids. No snapshot may contain two
// generations.
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
