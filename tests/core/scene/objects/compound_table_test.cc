#include "core/scene/objects/compound_table.h"

#include <gtest/gtest.h>

#include "core/scene/objects/object_store.h"

namespace locus {
namespace {

CompoundPtr compound_of(size_t parts, float radius = 1) {
  return Compound::make(std::vector<Part>(parts, Part{ShapeKind::kBall, {0, 0, 1}, {}, {}, radius, kAllLayers}));
}

Object object_with(Id id, const CompoundPtr& compound) {
  Object object;
  object.id = id;
  object.shape.kind = ShapeKind::kCompound;
  object.compound = compound.get();
  return object;
}

TEST(CompoundTableTest, ACompoundLivesAsLongAsAnObjectHasIt) {
  CompoundTable table;
  CompoundPtr compound = compound_of(2);
  const std::weak_ptr<const Compound> watched = compound;
  const Compound* const address = compound.get();
  table.add(address);
  table.add(address);
  compound.reset();
  EXPECT_EQ(table.size(), 1u);
  table.remove(address);
  EXPECT_EQ(table.take_replaced_bytes(), 0u);
  EXPECT_FALSE(watched.expired());
  table.remove(address);
  EXPECT_GT(table.take_replaced_bytes(), 0u);
  EXPECT_TRUE(watched.expired());
  EXPECT_EQ(table.snapshot(), nullptr);
}

TEST(CompoundTableTest, ASnapshotKeepsItsCompounds) {
  CompoundTable table;
  CompoundPtr compound = compound_of(2);
  const std::weak_ptr<const Compound> watched = compound;
  const Compound* const address = compound.get();
  table.add(address);
  compound.reset();
  std::shared_ptr<const CompoundArray> snapshot = table.snapshot();
  table.remove(address);
  table.snapshot();
  EXPECT_FALSE(watched.expired());
  EXPECT_GE(unshared_bytes(snapshot, nullptr), watched.lock()->bytes());
  EXPECT_EQ(unshared_bytes(snapshot, snapshot), 0u);
  snapshot.reset();
  EXPECT_TRUE(watched.expired());
}

TEST(CompoundTableTest, ObjectsWithoutCompoundsCostNothing) {
  CompoundTable table;
  table.add(nullptr);
  table.remove(nullptr);
  EXPECT_EQ(table.take_replaced_bytes(), 0u);
  EXPECT_EQ(table.snapshot(), nullptr);
}

// Compounds that come and go between snapshots: the replaced bytes are at least the bytes that only an earlier snapshot
// keeps, and not more than that and the pointers of one leaf for each change.
TEST(CompoundTableTest, ReplacedBytesAreThoseThatOnlyEarlierSnapshotsKeep) {
  constexpr size_t kCompounds = 1000;
  CompoundTable table;
  std::vector<CompoundPtr> compounds;
  for (size_t i = 0; i < kCompounds; ++i) compounds.push_back(compound_of(2));
  for (const CompoundPtr& compound : compounds) table.add(compound.get());
  EXPECT_EQ(table.take_replaced_bytes(), 0u) << "there is no snapshot";
  const std::shared_ptr<const CompoundArray> before = table.snapshot();
  std::shared_ptr<const CompoundArray> last = before;
  size_t replaced = 0;
  for (size_t round = 0; round < 10; ++round) {
    for (size_t i = 0; i < 5; ++i) table.remove(compounds[200 * i + round].get());
    for (size_t i = 0; i < 5; ++i) table.add(compounds[200 * i + round].get());
    table.add(compounds.emplace_back(compound_of(3)).get());
    const size_t more = table.take_replaced_bytes();
    const std::shared_ptr<const CompoundArray> next = table.snapshot();
    const size_t removed = 5 * compounds[0]->bytes();  // they are added again
    EXPECT_GE(more, unshared_bytes(last, next)) << round;
    EXPECT_LE(more, unshared_bytes(last, next) + removed) << round;
    replaced += more;
    last = next;
  }
  EXPECT_GE(replaced, unshared_bytes(before, last));
}

TEST(CompoundTableTest, SetsOfObjectsKeepAndCountTheirCompounds) {
  ObjectStore store;
  const CompoundPtr first = compound_of(4), second = compound_of(4, 2);
  store.insert(object_with(1, first));
  const ObjectSet before = store.snapshot();
  const Object one = object_with(1, first), other = object_with(1, second);
  const size_t replaced = store.apply({&one, 1}, {&other, 1});
  EXPECT_GE(replaced, first->bytes());
  const ObjectSet after = store.snapshot();
  EXPECT_EQ(*before.find(1)->compound, *first);
  EXPECT_EQ(*after.find(1)->compound, *second);
  EXPECT_GE(before.unshared_bytes(after), first->bytes());
  EXPECT_EQ(after.find_ref(1).reach(), second->extent());
}

TEST(CompoundTableTest, SetsWithTheSamePartsCompareEqual) {
  const CompoundPtr first = compound_of(2), same = compound_of(2), other = compound_of(3);
  EXPECT_EQ(object_with(1, first), object_with(1, same));
  EXPECT_FALSE(object_with(1, first) == object_with(1, other));
}

}  // namespace
}  // namespace locus
