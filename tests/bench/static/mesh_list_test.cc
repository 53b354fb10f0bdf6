#include "tests/bench/static/mesh_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

namespace locus::bench {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class MeshListTest : public testing::Test {
 protected:
  Options options_;
  std::vector<std::string> notes_;
};

TEST_F(MeshListTest, MeshesOfTheOptionsReplaceTheSuitesOwn) {
  options_.meshes = {"city:100", "level.obj"};
  EXPECT_THAT(meshes_of(options_, notes_), ElementsAre("city:100", "level.obj"));
}

TEST_F(MeshListTest, InAQuickRunAllMeshesAreSmallAndGenerated) {
  options_.quick = true;
  EXPECT_THAT(meshes_of(options_, notes_), ElementsAre("city:2000", "blob:5000"));
  EXPECT_THAT(notes_, IsEmpty());
}

TEST_F(MeshListTest, MissingLevelsAreNoted) {
  options_.levels = "/no/such/folder";
  EXPECT_THAT(meshes_of(options_, notes_), SizeIs(4));
  ASSERT_THAT(notes_, SizeIs(2));
  EXPECT_THAT(notes_[0], HasSubstr("the level delta is left out: no /no/such/folder/pak1-maps.pk3"));
  EXPECT_THAT(notes_[0], HasSubstr("run tests/bench/fetch_levels.sh"));
}

TEST_F(MeshListTest, AFetchedLevelIsUsedWithItsEntry) {
  options_.levels = testing::TempDir();
  std::ofstream(testing::TempDir() + "/pak1-maps.pk3") << "level";
  EXPECT_THAT(meshes_of(options_, notes_), Contains(testing::TempDir() + "/pak1-maps.pk3#maps/delta.bsp"));
}

}  // namespace
}  // namespace locus::bench
