#include "core/scene/updates/writer_table.h"

#include <gtest/gtest.h>

#include "tests/support/random.h"
#include "tests/support/scene_difference.h"

namespace locus::test {
namespace {

UpdateAck ack_with(uint64_t revision, size_t errors) {
  UpdateAck ack;
  ack.epoch = 1;
  ack.revision = revision;
  ack.errors.resize(errors);
  return ack;
}

TEST(WriterTableTest, ABatchIsNewIfItIsTheNextOfItsWriterOrHasNoWriter) {
  WriterTable table;
  table.record(5, 1, ack_with(1, 0));
  for (uint64_t writer : {0, 5, 6}) {
    for (uint64_t batch = 1; batch < 4; ++batch) {
      const auto known = table.admit(writer, batch);
      const bool is_new = known.ok() && !*known;
      EXPECT_EQ(is_new, writer == 0 || batch == (writer == 5 ? 2u : 1u)) << writer << " " << batch;
    }
  }
}

TEST(WriterTableTest, ARestoredTableEvictsTheSameWritersInTheSameOrder) {
  Random random(1);
  WriterTable table;
  for (uint64_t writer = 1; writer <= limits::kMaxWriters; ++writer)
    for (uint64_t batch = 1; batch <= 2; ++batch) table.record(writer, batch, ack_with(batch, 0));
  for (int i = 0; i < 300; ++i) table.record(1 + random.below(limits::kMaxWriters), 3, ack_with(3, random.below(50)));
  WriterTable again;
  for (WriterTable::Writer& writer : table.writers()) ASSERT_TRUE(again.restore(std::move(writer)));
  EXPECT_EQ(writers_difference(again, table), "");
  for (uint64_t writer = 10'000; writer < 10'100; ++writer) {
    for (WriterTable* one : {&table, &again}) one->record(writer, 1, ack_with(4, 1000));
    ASSERT_EQ(writers_difference(again, table), "");
  }
}

TEST(WriterTableTest, InvalidEntriesAreNotRestored) {
  WriterTable table;
  EXPECT_TRUE(table.restore({5, 1, 1, {}}));
  EXPECT_FALSE(table.restore({5, 2, 2, {}}));
  EXPECT_FALSE(table.restore({0, 1, 2, {}}));
  EXPECT_FALSE(table.restore({6, 0, 2, {}}));
  EXPECT_FALSE(table.restore({6, 1, 2, ack_with(1, WriterTable::kMaxKeptErrors + 1)}));
  EXPECT_EQ(table.size(), 1u);
}

}  // namespace
}  // namespace locus::test
