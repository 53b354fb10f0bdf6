#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/support/postgres_log_fixture.h"

namespace locus::server {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class PostgresLogListingTest : public test::PostgresLogFixture {
 protected:
  static std::vector<std::string> scene_names(const PostgresLog& log, const std::string& after, size_t limit) {
    std::vector<std::string> names;
    const auto scenes = log.list_catalogued(after, limit);
    EXPECT_TRUE(scenes.ok()) << scenes.status();
    if (!scenes.ok()) return {};
    for (const CatalogueScene& scene : *scenes) names.push_back(scene.name);
    return names;
  }
  static std::vector<std::string> mesh_names(const PostgresLog& log, const std::string& after, size_t limit) {
    std::vector<std::string> names;
    const auto meshes = log.list_stored_meshes(after, limit);
    EXPECT_TRUE(meshes.ok()) << meshes.status();
    if (!meshes.ok()) return {};
    for (const StoredMesh& mesh : *meshes) names.push_back(mesh.name);
    return names;
  }
};

TEST_F(PostgresLogListingTest, ASceneIsFoundAsItIsNow) {
  PostgresOptions options = engine_->options();
  options.member = 55;
  const auto leader = another(options);
  const SceneKey scene = test::create_scene(*leader, "a", 1).value();
  ASSERT_EQ(test::append_records(*leader, scene, 7, 3), absl::OkStatus());
  const auto found = own_->find_catalogued("a");
  ASSERT_TRUE(found.ok()) << found.status();
  ASSERT_TRUE(found->has_value());
  EXPECT_EQ((*found)->key, scene);
  EXPECT_EQ((*found)->name, "a");
  EXPECT_EQ((*found)->spec, "spec of a");
  EXPECT_EQ((*found)->epoch, 7u);
  EXPECT_EQ((*found)->member, 55u);
  EXPECT_EQ((*found)->token, 1u);
  EXPECT_EQ((*found)->last_sequence, 3u);
  EXPECT_EQ((*found)->damage, absl::OkStatus());
  EXPECT_FALSE(own_->find_catalogued("A").value().has_value());
  ASSERT_EQ(leader->delete_scene(scene), absl::OkStatus());
  EXPECT_FALSE(own_->find_catalogued("a").value().has_value());
}

TEST_F(PostgresLogListingTest, ScenesAndMeshesAreListedInPagesInTheOrderOfTheirBytes) {
  SceneKey key = 0;
  for (const char* const name : {"b", "a-2", "B", "a", "ä", "a1"}) {
    create(name, ++key);
    ASSERT_EQ(add_mesh(name, 1, {"content"}), absl::OkStatus());
  }
  const auto log = another();
  EXPECT_THAT(scene_names(*log, "", 100), ElementsAre("B", "a", "a-2", "a1", "b", "ä"));
  EXPECT_THAT(scene_names(*log, "", 2), ElementsAre("B", "a"));
  EXPECT_THAT(scene_names(*log, "a", 2), ElementsAre("a-2", "a1"));
  EXPECT_THAT(scene_names(*log, "a1", static_cast<size_t>(-1)), ElementsAre("b", "ä"));
  EXPECT_THAT(scene_names(*log, "ä", 5), ElementsAre());
  EXPECT_THAT(mesh_names(*log, "", 100), ElementsAre("B", "a", "a-2", "a1", "b", "ä"));
  EXPECT_THAT(mesh_names(*log, "a", 3), ElementsAre("a-2", "a1", "b"));
}

TEST_F(PostgresLogListingTest, AMeshIsFoundAsItIsNow) {
  const auto log = another();
  EXPECT_FALSE(log->find_stored_mesh("m").value().has_value());
  ASSERT_EQ(add_mesh("m", 3, {"content"}), absl::OkStatus());
  ASSERT_EQ(log_->set_mesh_graces({"m"}, 60), absl::OkStatus());
  const auto found = log->find_stored_mesh("m");
  ASSERT_TRUE(found.ok()) << found.status();
  ASSERT_TRUE(found->has_value());
  EXPECT_EQ((*found)->sha256, test::hash_of(3));
  EXPECT_EQ((*found)->grace_s, 60u);
  EXPECT_EQ((*found)->damage, absl::OkStatus());
}

TEST_F(PostgresLogListingTest, ADamagedSceneAndMeshAreListedWithTheirNames) {
  create("a", 1);
  create("b", 2);
  ASSERT_EQ(add_mesh("m", 3, {"content"}), absl::OkStatus());
  ASSERT_EQ(engine_->query("UPDATE locus.scene SET epoch = 8 WHERE key = 1"), "");
  ASSERT_EQ(engine_->query("UPDATE locus.mesh SET grace_s = 8"), "");
  const auto scenes = own_->list_catalogued("", 10);
  ASSERT_TRUE(scenes.ok()) << scenes.status();
  ASSERT_EQ(scenes->size(), 2u);
  EXPECT_EQ((*scenes)[0].damage.code(), absl::StatusCode::kDataLoss);
  EXPECT_THAT(std::string((*scenes)[0].damage.message()), HasSubstr("'a'"));
  EXPECT_EQ((*scenes)[1].damage, absl::OkStatus());
  EXPECT_EQ(own_->find_stored_mesh("m").value()->damage.code(), absl::StatusCode::kDataLoss);
}

// Else each page would sort all names.
TEST_F(PostgresLogListingTest, TheIndexesOfNamesHaveTheOrderOfThePages) {
  EXPECT_EQ(engine_->query("SELECT string_agg(table_name || ':' || collation_name, ' ' ORDER BY table_name)"
                           " FROM information_schema.columns WHERE table_schema = 'locus' AND column_name = 'name'"),
            "mesh:C scene:C scene_mesh:C");
}

TEST_F(PostgresLogListingTest, ALogThatListsNothingIsOpenedWithoutTheCatalogue) {
  const SceneKey scene = create("a", 1);
  ASSERT_EQ(add_mesh("m", 3, {"content"}), absl::OkStatus());
  append(scene, 2);
  PostgresOptions options = engine_->options();
  options.list_catalogue = false;
  options.append_wait = std::chrono::milliseconds(500);
  const auto log = another(options);
  EXPECT_TRUE(log->stored_scenes().empty());
  EXPECT_TRUE(log->stored_meshes().empty());
  EXPECT_EQ(log->find_catalogued("a").value()->last_sequence, 2u);
  engine_->stop(SIGKILL);
  EXPECT_EQ(PostgresLog::open(options).status().code(), absl::StatusCode::kUnavailable);
}

}  // namespace
}  // namespace locus::server
