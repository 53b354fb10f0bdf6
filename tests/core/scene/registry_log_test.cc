// Tests a registry with a log: after a restart, the registry contains exactly the acknowledged scenes and meshes.
#include <gmock/gmock.h>

#include <chrono>
#include <semaphore>
#include <thread>

#include "core/scene/recovery.h"
#include "core/scene/registry.h"
#include "tests/support/memory_log.h"
#include "tests/support/scene_difference.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Pair;

class RegistryLogTest : public SceneFixture {
 protected:
  absl::StatusOr<Registry::CreatedScene> create(const std::string& name, const std::string& static_from = "") {
    return registry_->create_scene(name, {}, kEpoch, static_from, false);
  }

  std::vector<std::string> scene_names() const {
    std::vector<std::string> names;
    for (const ScenePtr& scene : registry_->list_scenes("", 100)) names.push_back(scene->name());
    return names;
  }

  // Simulates a crash of the machine and a restart.
  void restart() {
    auto log = std::make_unique<MemoryLog>(log_->crash());
    registry_ = std::make_unique<Registry>(log.get());
    log_ = std::move(log);
    for (const StoredMesh& stored : log_->stored_meshes()) {
      const absl::StatusOr<RecoveredMesh> mesh = recover_mesh(*log_, stored);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      EXPECT_FALSE(mesh->built) << "the topology was stored with the mesh";
      const absl::StatusOr<MeshPtr> named = recover_name(*log_, stored, mesh->mesh);
      ASSERT_TRUE(named.ok()) << named.status();
      registry_->restore_mesh(stored.name, *named, stored.grace_s);
    }
    for (const StoredScene& stored : log_->stored_scenes()) {
      const absl::StatusOr<ScenePtr> scene = recover_scene(*log_, stored, find_restored_meshes(*log_, *registry_));
      ASSERT_TRUE(scene.ok()) << scene.status();
      registry_->restore_scene(*scene);
    }
  }

  std::unique_ptr<MemoryLog> log_ = std::make_unique<MemoryLog>();
  std::unique_ptr<Registry> registry_ = std::make_unique<Registry>(log_.get());
};

const absl::Status kFull = absl::ResourceExhaustedError("the disk is full");

TEST_F(RegistryLogTest, ScenesMeshesAndInstancesSurviveARestart) {
  ASSERT_TRUE(registry_->add_mesh("m", mesh_).ok());
  ASSERT_TRUE(registry_->add_mesh("alias", mesh_).ok());
  const ScenePtr first = create("first")->scene;
  ASSERT_TRUE(first->change_instances(placing(placement({5}, {1, 2, 3}))).ok());
  const ScenePtr second = create("second", "first")->scene;
  ASSERT_TRUE(second->apply(with(points({1}, {0, 0, 0}))).ok());
  restart();
  EXPECT_THAT(scene_names(), ElementsAre("first", "second"));
  Random random(1);
  EXPECT_EQ(scene_difference(**registry_->find_scene("first"), *first, random), "");
  EXPECT_EQ(scene_difference(**registry_->find_scene("second"), *second, random), "");
  const MeshPtr mesh = *registry_->find_mesh("m", "mesh");
  EXPECT_EQ(mesh->triangle(0).b, mesh_->triangle(0).b);
  EXPECT_EQ(&(*registry_->find_mesh("alias", "mesh"))->tree(), &mesh->tree());
  EXPECT_EQ(registry_->mesh_uses(mesh.get()), 2u);
  EXPECT_EQ(registry_->delete_mesh("m").code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(RegistryLogTest, CollectableMeshesSurviveARestart) {
  const MeshPtr mesh = *registry_->add_mesh("m", mesh_);
  ASSERT_TRUE(registry_->add_mesh("alias", mesh_).ok());
  log_->fail_with(kFull);
  EXPECT_EQ(registry_->make_collectable({mesh.get()}, 60), kFull);
  EXPECT_THAT(registry_->collectable_meshes(), IsEmpty());
  log_->fail_with(absl::OkStatus());
  ASSERT_TRUE(registry_->make_collectable({mesh.get()}, 60).ok());
  restart();
  ASSERT_EQ(registry_->collectable_meshes().size(), 1u);
  EXPECT_EQ(registry_->collectable_meshes()[0].mesh, *registry_->find_mesh("m", "mesh"));
  EXPECT_EQ(registry_->collectable_meshes()[0].grace_s, 60u);
  const MeshPtr restored = registry_->collectable_meshes()[0].mesh;
  log_->fail_with(kFull);
  EXPECT_EQ(registry_->delete_mesh_if(restored, [] { return true; }).status(), kFull);
  EXPECT_EQ(registry_->collectable_meshes().size(), 1u) << "the deletion failed";
  log_->fail_with(absl::OkStatus());
  EXPECT_TRUE(*registry_->delete_mesh_if(restored, [] { return true; }));
  restart();
  EXPECT_THAT(registry_->collectable_meshes(), IsEmpty());
  EXPECT_FALSE(registry_->find_mesh("m", "mesh").ok());
  EXPECT_TRUE(registry_->find_mesh("alias", "mesh").ok());
}

TEST_F(RegistryLogTest, AConditionalDeletionThatTheLogRefusesLeavesTheScene) {
  const ScenePtr scene = create("arena")->scene;
  log_->fail_with(kFull);
  EXPECT_EQ(registry_->delete_scene_if(scene, [] { return true; }).status(), kFull);
  EXPECT_THAT(scene_names(), ElementsAre("arena"));
  log_->fail_with(absl::OkStatus());
  EXPECT_TRUE(*registry_->delete_scene_if(scene, [] { return true; }));
  restart();
  EXPECT_THAT(scene_names(), IsEmpty());
}

TEST_F(RegistryLogTest, CreatorsSurviveARestartAndAFailedDeletion) {
  SceneSpec spec;
  spec.creator = "token:a";
  spec.history = {4, 1000};
  ASSERT_TRUE(registry_->add_mesh("m", StaticMesh::share("m", {}, *mesh_, "token:a")).ok());
  const ScenePtr scene = registry_->create_scene("first", spec, kEpoch, "", false)->scene;
  ASSERT_TRUE(scene->apply(with(points({1, 2}, {0, 0, 0}))).ok());
  for (int times = 0; times < 2; ++times) {
    restart();
    log_->fail_with(kFull);
    EXPECT_EQ(registry_->delete_mesh("m"), kFull);
    EXPECT_EQ(registry_->delete_scene("first"), kFull);
    log_->fail_with(absl::OkStatus());
    const CreatorUse use = registry_->creator_use("token:a");
    EXPECT_EQ(use.scenes, 1u);
    EXPECT_EQ(use.objects, 2u);
    EXPECT_EQ(use.history_bytes, 1000u);
    EXPECT_EQ(use.mesh_bytes, (*registry_->find_mesh("m", "mesh"))->bytes());
  }
}

TEST_F(RegistryLogTest, NamesOfEqualContentKeepPartsAndUsesOverARestart) {
  const std::vector<MeshPart> walls = {{"walls", 0}}, doors = {{"doors", 0}};
  PlacementColumns first = placement({5, 6}, {1, 2, 3}), second = placement({7}, {4, 5, 6});
  first.mesh = *registry_->add_mesh("m", StaticMesh::share("m", walls, *mesh_));
  second.mesh = *registry_->add_mesh("alias", StaticMesh::share("alias", doors, *mesh_));
  StaticChange change = placing(first);
  change.place.push_back(second);
  ASSERT_TRUE(create("recorded")->scene->change_instances(change).ok());
  ASSERT_TRUE(create("snapshotted", "recorded").ok());
  for (int times = 0; times < 2; ++times) {
    restart();
    const MeshPtr m = *registry_->find_mesh("m", "mesh"), alias = *registry_->find_mesh("alias", "mesh");
    EXPECT_EQ(m->parts(), walls);
    EXPECT_EQ(alias->parts(), doors);
    EXPECT_EQ(&m->tree(), &alias->tree());
    EXPECT_EQ(registry_->mesh_uses(m.get()), 4u);
    EXPECT_EQ(registry_->mesh_uses(alias.get()), 2u);
    for (const char* const scene : {"recorded", "snapshotted"}) {
      const SnapshotPtr latest = (*registry_->find_scene(scene))->latest();
      EXPECT_EQ(latest->statics->find(6)->mesh, m) << scene;
      EXPECT_EQ(latest->statics->find(7)->mesh, alias) << scene;
    }
  }
  StaticChange removal;
  removal.remove_ids = columns_.ids({5, 6});
  for (const char* const scene : {"recorded", "snapshotted"})
    ASSERT_TRUE((*registry_->find_scene(scene))->change_instances(removal).ok());
  EXPECT_TRUE(registry_->delete_mesh("m").ok());
  restart();
  EXPECT_EQ((*registry_->find_mesh("alias", "mesh"))->parts(), doors);
  EXPECT_EQ(registry_->delete_mesh("alias").code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(RegistryLogTest, ARecordWithoutANameMeansTheLowestNameOfFormat1) {
  for (const char* const name : {"b", "c", "d"}) ASSERT_TRUE(registry_->add_mesh(name, mesh_).ok());
  MemoryLog::Kept kept = log_->crash();
  for (const char* const name : {"c", "d"}) kept.parts.erase(name);  // format 1 stores no parts for a name
  const MemoryLog log(kept);
  EXPECT_TRUE(log.stored_meshes()[1].parts_in_content);
  const FindMesh find = find_restored_meshes(log, *registry_);
  EXPECT_EQ(find({mesh_->sha256(), ""})->name(), "c");
  EXPECT_EQ(find({mesh_->sha256(), "d"})->name(), "d");
  ASSERT_TRUE(registry_->delete_mesh("d").ok());
  EXPECT_EQ(find({mesh_->sha256(), "d"}), nullptr);
}

TEST_F(RegistryLogTest, DamagedPartsAreTheDamageOfTheirNameAlone) {
  ASSERT_TRUE(registry_->add_mesh("m", mesh_).ok());
  ASSERT_TRUE(registry_->add_mesh("alias", mesh_).ok());
  MemoryLog::Kept kept = log_->crash();
  kept.parts.at("m").clear();
  MemoryLog log(kept);
  ASSERT_EQ(log.stored_meshes().size(), 2u);
  const absl::StatusOr<RecoveredMesh> content = recover_mesh(log, log.stored_meshes()[0]);
  ASSERT_TRUE(content.ok()) << content.status();
  EXPECT_TRUE(recover_name(log, log.stored_meshes()[0], content->mesh).ok());
  EXPECT_EQ(recover_name(log, log.stored_meshes()[1], content->mesh).status(),
            absl::DataLossError("mesh m: the header of parts is missing"));
}

TEST_F(RegistryLogTest, DeletedScenesAndMeshesStayDeleted) {
  ASSERT_TRUE(registry_->add_mesh("m", mesh_).ok());
  ASSERT_TRUE(create("gone").ok());
  EXPECT_TRUE(registry_->delete_scene("gone").ok());
  EXPECT_TRUE(registry_->delete_mesh("m").ok());
  restart();
  EXPECT_THAT(scene_names(), IsEmpty());
  EXPECT_EQ(registry_->mesh_count(), 0u);
}

TEST_F(RegistryLogTest, AfterALogErrorNothingHasChanged) {
  ASSERT_TRUE(registry_->add_mesh("m", mesh_).ok());
  const ScenePtr scene = create("a")->scene;
  log_->fail_with(kFull);
  EXPECT_EQ(create("b").status(), kFull);
  EXPECT_EQ(registry_->delete_scene("a"), kFull);
  EXPECT_EQ(registry_->add_mesh("n", make_mesh("n", 2)).status(), kFull);
  EXPECT_EQ(registry_->delete_mesh("m"), kFull);
  EXPECT_THAT(scene_names(), ElementsAre("a"));
  EXPECT_EQ(registry_->find_scene("b").status().code(), absl::StatusCode::kNotFound);
  EXPECT_FALSE(registry_->find_mesh("n", "mesh").ok());
  EXPECT_EQ(*registry_->find_mesh("m", "mesh"), mesh_);
  log_->fail_with(absl::OkStatus());
  EXPECT_TRUE(scene->apply(with(points({1}, {0, 0, 0}))).ok());
  EXPECT_TRUE(create("b").ok());
}

TEST_F(RegistryLogTest, OtherScenesAreFoundWhileASceneIsCreated) {
  const ScenePtr known = create("known")->scene;
  log_->hold();
  std::thread creator([this] { EXPECT_TRUE(create("new").ok()); });
  log_->wait_for_writer();
  EXPECT_EQ(*registry_->find_scene("known"), known);
  EXPECT_EQ(registry_->find_scene("new").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(registry_->scene_count(), 1u);
  log_->release();
  creator.join();
  EXPECT_TRUE(registry_->find_scene("new").ok());
}

TEST_F(RegistryLogTest, ADeletedMeshIsNotPlaced) {
  ASSERT_TRUE(registry_->add_mesh("m", mesh_).ok());
  const ScenePtr scene = create("a")->scene;
  ASSERT_TRUE(registry_->delete_mesh("m").ok());
  expect_refusal(scene->change_instances(placing(placement({5}, {0, 0, 0}))).status(), absl::StatusCode::kNotFound,
                 Reason::kNotFound, "place[0].mesh");
  // placement() refers to mesh_, the deleted StaticMesh. The registry does not count uses of a deleted StaticMesh, so
  // the change is refused even after another mesh with the same name and content is added.
  ASSERT_TRUE(registry_->add_mesh("m", make_mesh("m", 1)).ok());
  EXPECT_EQ(scene->change_instances(placing(placement({5}, {0, 0, 0}))).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(RegistryLogTest, AMeshThatIsBeingPlacedIsNotDeleted) {
  ASSERT_TRUE(registry_->add_mesh("m", mesh_).ok());
  const ScenePtr scene = create("a")->scene;
  log_->hold();
  std::thread changer([&] { EXPECT_TRUE(scene->change_instances(placing(placement({5}, {0, 0, 0}))).ok()); });
  log_->wait_for_writer();
  const absl::Status status = registry_->delete_mesh("m");
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(status.message(), HasSubstr("is being placed"));
  log_->release();
  changer.join();
  EXPECT_EQ(registry_->mesh_uses(mesh_.get()), 1u);
}

TEST_F(RegistryLogTest, ADamagedSceneAnswersWithItsDamageUntilItIsDeleted) {
  ASSERT_TRUE(create("bad").ok());
  const SceneKey key = (*registry_->find_scene("bad"))->log_key();
  registry_ = std::make_unique<Registry>(log_.get());
  const absl::Status damage = absl::DataLossError("scene bad: record 7 is cut off");
  registry_->restore_damaged_scene("bad", key, damage);
  EXPECT_EQ(registry_->find_scene("bad").status(), damage);
  EXPECT_EQ(create("bad").status(), damage);
  EXPECT_EQ(registry_->create_scene("bad", {}, 9, "", true).status(), damage);
  EXPECT_EQ(create("other", "bad").status(), damage);
  EXPECT_THAT(scene_names(), IsEmpty());
  EXPECT_EQ(registry_->scene_count(), 0u);
  log_->fail_with(kFull);
  EXPECT_EQ(registry_->delete_scene("bad"), kFull);
  EXPECT_EQ(registry_->find_scene("bad").status(), damage);
  log_->fail_with(absl::OkStatus());
  EXPECT_TRUE(registry_->delete_scene("bad").ok());
  EXPECT_THAT(log_->crash().scenes, IsEmpty());
  EXPECT_TRUE(create("bad").ok());
}

TEST_F(RegistryLogTest, ADamagedMeshAnswersWithItsDamageUntilItIsDeleted) {
  ASSERT_TRUE(registry_->add_mesh("m", mesh_).ok());
  registry_ = std::make_unique<Registry>(log_.get());
  const absl::Status damage = absl::DataLossError("mesh m: vertices is cut off");
  registry_->restore_damaged_mesh("m", damage);
  EXPECT_EQ(registry_->find_mesh("m", "mesh").status(), damage);
  EXPECT_EQ(registry_->add_mesh("m", mesh_).status(), damage);
  EXPECT_TRUE(registry_->delete_mesh("m").ok());
  EXPECT_THAT(log_->crash().meshes, IsEmpty());
  EXPECT_TRUE(registry_->add_mesh("m", mesh_).ok());
}

// Log that blocks in add_mesh() until the test releases it.
class SlowMeshLog : public MemoryLog {
 public:
  absl::Status add_mesh(absl::string_view name, const std::array<uint8_t, 32>& sha256, ChunkSource content,
                        ChunkSource parts) override {
    begun.release();
    resume.acquire();
    return MemoryLog::add_mesh(name, sha256, content, parts);
  }
  std::binary_semaphore begun{0}, resume{0};
};

TEST_F(RegistryLogTest, ScenesAreCreatedAndDeletedWhileALargeMeshIsWrittenAndItsDeletionWaits) {
  SlowMeshLog log;
  Registry registry(&log);
  std::thread uploader([&] { EXPECT_TRUE(registry.add_mesh("m", mesh_).ok()); });
  log.begun.acquire();
  EXPECT_TRUE(registry.create_scene("a", {}, 1, "", false).ok());
  EXPECT_TRUE(registry.create_scene("b", {}, 2, "a", false).ok());
  EXPECT_TRUE(registry.delete_scene("a").ok());
  EXPECT_EQ(registry.find_content(mesh_->sha256()), nullptr) << "not before it is written";
  std::thread deleter([&] { EXPECT_TRUE(registry.delete_mesh("m").ok()) << "it waits for the upload"; });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  log.resume.release();
  uploader.join();
  deleter.join();
  EXPECT_EQ(registry.find_content(mesh_->sha256()), nullptr);
  EXPECT_EQ(log.crash().meshes.size(), 0u);
  EXPECT_EQ(log.crash().scenes.size(), 1u);
}

}  // namespace
}  // namespace locus::test
