#include "core/scene/registry.h"

#include "absl/strings/str_cat.h"
#include "core/base/limits.h"
#include "tests/support/scene_fixture.h"

namespace locus::test {
namespace {

class RegistryTest : public SceneFixture {
 protected:
  absl::StatusOr<Registry::CreatedScene> create(const std::string& name, const std::string& static_from = "",
                                                bool if_absent = false) {
    return registry_.create_scene(name, {}, ++epoch_, static_from, if_absent);
  }
  ScenePtr created(const std::string& name, const std::string& static_from = "") {
    const auto scene = create(name, static_from);
    EXPECT_TRUE(scene.ok()) << scene.status();
    return scene->scene;
  }

  static std::vector<std::string> names(const std::vector<ScenePtr>& scenes) {
    std::vector<std::string> result;
    for (const ScenePtr& scene : scenes) result.push_back(scene->name());
    return result;
  }

  Registry registry_;
  uint64_t epoch_ = 0;
};

using Names = std::vector<std::string>;
using MeshParts = std::vector<MeshPart>;

TEST_F(RegistryTest, ACreatedSceneIsFound) {
  const ScenePtr scene = created("arena");
  EXPECT_EQ(*registry_.find_scene("arena"), scene);
  EXPECT_EQ(scene->latest()->epoch, 1u);
  EXPECT_EQ(registry_.scene_count(), 1u);
}

TEST_F(RegistryTest, AnUnknownSceneIsNotFound) {
  expect_refusal(registry_.find_scene("arena").status(), absl::StatusCode::kNotFound, Reason::kNotFound, "scene");
}

TEST_F(RegistryTest, ABadNameIsRefused) {
  expect_refusal(create("Arena").status(), absl::StatusCode::kInvalidArgument, Reason::kMalformed, "name");
}

TEST_F(RegistryTest, ATakenNameIsRefused) {
  created("arena");
  expect_refusal(create("arena").status(), absl::StatusCode::kAlreadyExists, Reason::kAlreadyExists, "name");
}

TEST_F(RegistryTest, IfAbsentReturnsTheExistingScene) {
  const ScenePtr scene = created("arena");
  const auto again = create("arena", "nowhere", true);
  ASSERT_TRUE(again.ok());
  EXPECT_TRUE(again->existed);
  EXPECT_EQ(again->scene, scene);
  EXPECT_FALSE(create("other", "", true)->existed);
}

TEST_F(RegistryTest, TooManyScenesNameTheLimit) {
  for (uint32_t i = 0; i < limits::kMaxScenes; ++i) created(absl::StrCat("s", i));
  const absl::Status status = create("more").status();
  expect_refusal(status, absl::StatusCode::kResourceExhausted, Reason::kLimit, "name");
  EXPECT_EQ(refusal_of(status)->limit, "scenes");
  EXPECT_TRUE(registry_.delete_scene("s7").ok());
  EXPECT_TRUE(create("more").ok());
}

TEST_F(RegistryTest, ADeletedSceneIsClosedAndForgotten) {
  const ScenePtr scene = created("arena");
  EXPECT_TRUE(registry_.delete_scene("arena").ok());
  EXPECT_EQ(registry_.find_scene("arena").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(scene->apply({}).status().code(), absl::StatusCode::kNotFound);
  expect_refusal(registry_.delete_scene("arena"), absl::StatusCode::kNotFound, Reason::kNotFound, "name");
}

TEST_F(RegistryTest, ASceneIsDeletedOnlyIfTheConditionHolds) {
  const ScenePtr scene = created("arena");
  EXPECT_FALSE(*registry_.delete_scene_if(scene, [] { return false; }));
  EXPECT_EQ(*registry_.find_scene("arena"), scene);
  EXPECT_TRUE(*registry_.delete_scene_if(scene, [] { return true; }));
  EXPECT_EQ(registry_.find_scene("arena").status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(scene->apply({}).status().code(), absl::StatusCode::kNotFound);
}

TEST_F(RegistryTest, AConditionalDeletionSparesALaterSceneOfTheSameName) {
  const ScenePtr first = created("arena");
  ASSERT_TRUE(registry_.delete_scene("arena").ok());
  const ScenePtr second = created("arena");
  EXPECT_FALSE(*registry_.delete_scene_if(first, [] { return true; }));
  EXPECT_EQ(*registry_.find_scene("arena"), second);
}

TEST_F(RegistryTest, ScenesAreListedByNamePageByPage) {
  for (const char* name : {"d", "b", "a", "c"}) created(name);
  EXPECT_EQ(names(registry_.list_scenes("", 3)), (Names{"a", "b", "c"}));
  EXPECT_EQ(names(registry_.list_scenes("c", 3)), (Names{"d"}));
  EXPECT_EQ(names(registry_.list_scenes("bb", 1)), (Names{"c"}));  // `after` need not be the name of a scene
  EXPECT_TRUE(registry_.list_scenes("d", 3).empty());
}

TEST_F(RegistryTest, StaticFromSharesInstancesAndNotObjects) {
  const ScenePtr source = created("source");
  ASSERT_TRUE(source->change_instances(placing(placement({8}, {0, 0, 0}))).ok());
  ASSERT_TRUE(source->apply(with(points({1}, {0, 0, 0}))).ok());
  const ScenePtr copy = created("copy", "source");
  EXPECT_EQ(copy->latest()->statics, source->latest()->statics);
  EXPECT_EQ(copy->latest()->objects.size(), 0u);
  EXPECT_EQ(copy->latest()->revision, 0u);
}

TEST_F(RegistryTest, ChangesOfSharedInstancesAffectOneSceneOnly) {
  const ScenePtr source = created("source");
  ASSERT_TRUE(source->change_instances(placing(placement({8}, {0, 0, 0}))).ok());
  const ScenePtr copy = created("copy", "source");
  ASSERT_TRUE(copy->change_instances(placing(placement({9}, {0, 0, 0}))).ok());
  EXPECT_EQ(source->latest()->statics->size(), 1u);
  EXPECT_EQ(copy->latest()->statics->size(), 2u);
  EXPECT_EQ(copy->latest()->statics->find(8)->mesh, mesh_);
}

TEST_F(RegistryTest, StaticFromAnUnknownSceneIsNotFoundAndCreatesNothing) {
  expect_refusal(create("copy", "nowhere").status(), absl::StatusCode::kNotFound, Reason::kNotFound,
                 "spec.static_from");
  EXPECT_EQ(registry_.scene_count(), 0u);
}

TEST_F(RegistryTest, AMeshIsFoundByNameAndByContent) {
  ASSERT_TRUE(registry_.add_mesh("m", mesh_).ok());
  EXPECT_EQ(*registry_.find_mesh("m", "mesh"), mesh_);
  EXPECT_EQ(registry_.find_content(mesh_->sha256()), mesh_);
  EXPECT_EQ(registry_.find_content(make_mesh("x", 99)->sha256()), nullptr);
  expect_refusal(registry_.find_mesh("n", "place[0].mesh").status(), absl::StatusCode::kNotFound, Reason::kNotFound,
                 "place[0].mesh");
}

TEST_F(RegistryTest, TheSameContentUnderTheSameNameIsAccepted) {
  ASSERT_TRUE(registry_.add_mesh("m", mesh_).ok());
  EXPECT_EQ(*registry_.add_mesh("m", make_mesh("m", 1)), mesh_);
  EXPECT_EQ(registry_.mesh_count(), 1u);
}

TEST_F(RegistryTest, OtherContentUnderAKnownNameIsRefused) {
  ASSERT_TRUE(registry_.add_mesh("m", mesh_).ok());
  expect_refusal(registry_.add_mesh("m", make_mesh("m", 2)).status(), absl::StatusCode::kAlreadyExists,
                 Reason::kAlreadyExists, "mesh");
  EXPECT_EQ(*registry_.find_mesh("m", "mesh"), mesh_);
}

TEST_F(RegistryTest, EqualContentUnderTwoNamesIsHeldOnce) {
  ASSERT_TRUE(registry_.add_mesh("m", mesh_).ok());
  const MeshPtr alias = *registry_.add_mesh("alias", make_mesh("alias", 1));
  EXPECT_EQ(&alias->tree(), &mesh_->tree());
  EXPECT_EQ(*registry_.find_mesh("alias", "mesh"), alias);
  EXPECT_EQ(alias->name(), "alias");
  EXPECT_EQ(registry_.mesh_count(), 2u);
  EXPECT_EQ(registry_.mesh_bytes(), mesh_->bytes() + alias->bytes() - alias->shared_bytes());
}

TEST_F(RegistryTest, NamesOfEqualContentKeepTheirOwnParts) {
  const MeshParts walls = {{"walls", 0}}, doors = {{"doors", 0}};
  ASSERT_TRUE(registry_.add_mesh("m", StaticMesh::share("m", walls, *mesh_)).ok());
  ASSERT_TRUE(registry_.add_mesh("alias", StaticMesh::share("alias", doors, *mesh_)).ok());
  EXPECT_EQ((*registry_.find_mesh("m", "mesh"))->parts(), walls);
  EXPECT_EQ((*registry_.find_mesh("alias", "mesh"))->parts(), doors);
}

TEST_F(RegistryTest, ScenesObjectsHistoriesAndMeshesAreSummedByCreator) {
  SceneSpec spec;
  spec.creator = "token:a";
  spec.history = {4, 1000};
  const ScenePtr first = registry_.create_scene("first", spec, kEpoch, "", false)->scene;
  spec.history = {};
  ASSERT_TRUE(registry_.create_scene("second", spec, kEpoch, "", false).ok());
  created("nobodys");
  ASSERT_TRUE(first->apply(with(points({1, 2, 3}, {0, 0, 0}))).ok());
  const MeshPtr m = *registry_.add_mesh("m", StaticMesh::share("m", {}, *mesh_, "token:a"));
  const MeshPtr alias = *registry_.add_mesh("alias", StaticMesh::share("alias", {}, *mesh_, "token:b"));
  EXPECT_EQ(alias->creator(), "token:b");
  CreatorUse use = registry_.creator_use("token:a");
  EXPECT_EQ(use.scenes, 2u);
  EXPECT_EQ(use.objects, 3u);
  EXPECT_EQ(use.history_bytes, 1000u);
  EXPECT_EQ(use.mesh_bytes, m->bytes());
  EXPECT_EQ(registry_.creator_uses().size(), 2u);
  UpdateBatch removal;
  const std::vector<uint64_t> gone = {1, 2};
  removal.remove_ids = gone;
  ASSERT_TRUE(first->apply(removal).ok());
  EXPECT_EQ(registry_.creator_use("token:a").objects, 1u);
  ASSERT_TRUE(registry_.delete_scene("first").ok());
  ASSERT_TRUE(registry_.delete_mesh("m").ok());
  use = registry_.creator_use("token:a");
  EXPECT_EQ(use.scenes, 1u);
  EXPECT_EQ(use.objects + use.history_bytes + use.mesh_bytes, 0u);
  ASSERT_TRUE(registry_.delete_scene("second").ok());
  ASSERT_TRUE(registry_.delete_mesh("alias").ok());
  EXPECT_TRUE(registry_.creator_uses().empty());
}

TEST_F(RegistryTest, OtherPartsUnderAKnownNameAreRefused) {
  ASSERT_TRUE(registry_.add_mesh("m", StaticMesh::share("m", {{"walls", 0}}, *mesh_)).ok());
  EXPECT_TRUE(registry_.add_mesh("m", StaticMesh::share("m", {{"walls", 0}}, *mesh_)).ok());
  expect_refusal(registry_.add_mesh("m", mesh_).status(), absl::StatusCode::kAlreadyExists, Reason::kAlreadyExists,
                 "mesh");
  EXPECT_EQ((*registry_.find_mesh("m", "mesh"))->parts(), (MeshParts{{"walls", 0}}));
}

TEST_F(RegistryTest, InstancesUseTheNameThatTheyWerePlacedUnder) {
  for (const char* const unused : {"m", "alias"}) {
    Registry registry;
    ASSERT_TRUE(registry.add_mesh("m", mesh_).ok());
    ASSERT_TRUE(registry.add_mesh("alias", mesh_).ok());
    const std::string used = unused == std::string("m") ? "alias" : "m";
    const ScenePtr scene = registry.create_scene("a", {}, 1, "", false)->scene;
    PlacementColumns place = placement({1, 2}, {0, 0, 0});
    place.mesh = *registry.find_mesh(used, "mesh");
    ASSERT_TRUE(scene->change_instances(placing(place)).ok());
    for (const Registry::NamedMesh& mesh : registry.list_meshes("", 5))
      EXPECT_EQ(mesh.uses, mesh.name == used ? 2u : 0u) << mesh.name;
    expect_refusal(registry.delete_mesh(used), absl::StatusCode::kFailedPrecondition, Reason::kInUse, "mesh");
    EXPECT_TRUE(registry.delete_mesh(unused).ok());
    EXPECT_EQ(registry.find_content(mesh_->sha256()), place.mesh) << "the content lives under the other name";
    EXPECT_TRUE(registry.delete_scene("a").ok());
    EXPECT_TRUE(registry.delete_mesh(used).ok());
    EXPECT_EQ(registry.find_content(mesh_->sha256()), nullptr);
  }
}

TEST_F(RegistryTest, AStoredMeshIsFoundByNameAndContentOrWithoutANameByContent) {
  ASSERT_TRUE(registry_.add_mesh("m", mesh_).ok());
  const MeshPtr alias = *registry_.add_mesh("alias", mesh_);
  EXPECT_EQ(registry_.find_stored(mesh_->key()), mesh_);
  EXPECT_EQ(registry_.find_stored({mesh_->sha256(), ""}), alias) << "the lowest name";
  EXPECT_EQ(registry_.find_stored({mesh_->sha256(), "gone"}), nullptr);
  EXPECT_EQ(registry_.find_stored({Sha256{9}, "m"}), nullptr);
}

TEST_F(RegistryTest, AnUnusedMeshIsDeleted) {
  ASSERT_TRUE(registry_.add_mesh("m", mesh_).ok());
  EXPECT_TRUE(registry_.delete_mesh("m").ok());
  EXPECT_EQ(registry_.mesh_count(), 0u);
  expect_refusal(registry_.delete_mesh("m"), absl::StatusCode::kNotFound, Reason::kNotFound, "mesh");
}

TEST_F(RegistryTest, ADeletedMeshIsFreedThoughRecentRevisionsContainedIt) {
  mesh_ = *registry_.add_mesh("m", make_mesh("m", 1));
  const ScenePtr scene = created("a");
  ASSERT_TRUE(scene->change_instances(placing(placement({1}, {0, 0, 0}))).ok());
  StaticChange removal;
  const Id id = 1;
  removal.remove_ids = {&id, 1};
  ASSERT_TRUE(scene->change_instances(removal).ok());
  ASSERT_TRUE(scene->apply(with(points({2}, {0, 0, 0}))).ok());
  const std::weak_ptr<const StaticMesh> mesh = std::exchange(mesh_, nullptr);
  const auto revision = [&](uint64_t number) {
    return scene->view({View::Kind::kExactly, number, 0}, std::chrono::steady_clock::time_point::min());
  };
  EXPECT_TRUE(revision(1).ok()) << "recent revisions stay while the mesh is registered";
  ASSERT_TRUE(registry_.delete_mesh("m").ok());
  EXPECT_TRUE(mesh.expired());
  EXPECT_EQ(revision(1).status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_TRUE(revision(2).ok()) << "revisions after the removal stay";
  EXPECT_TRUE(revision(3).ok());
}

TEST_F(RegistryTest, AUsedMeshIsNotDeletedAndItsUsesOfAllScenesAreCounted) {
  ASSERT_TRUE(registry_.add_mesh("m", mesh_).ok());
  ASSERT_TRUE(created("a")->change_instances(placing(placement({1, 2}, {0, 0, 0}))).ok());
  created("b", "a");
  const absl::Status status = registry_.delete_mesh("m");
  expect_refusal(status, absl::StatusCode::kFailedPrecondition, Reason::kInUse, "mesh");
  EXPECT_EQ(refusal_of(status)->asked, 4);
  EXPECT_EQ(registry_.mesh_uses(mesh_.get()), 4u);
  EXPECT_TRUE(registry_.delete_scene("a").ok());
  EXPECT_EQ(registry_.mesh_uses(mesh_.get()), 2u);
  EXPECT_TRUE(registry_.delete_scene("b").ok());
  EXPECT_TRUE(registry_.delete_mesh("m").ok());
}

TEST_F(RegistryTest, TheLongestGraceOfACollectableMeshApplies) {
  const MeshPtr mesh = *registry_.add_mesh("m", mesh_);
  EXPECT_TRUE(registry_.collectable_meshes().empty());
  for (const uint32_t grace_s : {10, 60, 20}) ASSERT_TRUE(registry_.make_collectable({mesh.get()}, grace_s).ok());
  const std::vector<Registry::CollectableMesh> meshes = registry_.collectable_meshes();
  ASSERT_EQ(meshes.size(), 1u);
  EXPECT_EQ(meshes[0].mesh, mesh);
  EXPECT_EQ(meshes[0].grace_s, 60u);
  ASSERT_TRUE(registry_.delete_mesh("m").ok());
  ASSERT_TRUE(registry_.make_collectable({mesh.get()}, 10).ok());
  EXPECT_TRUE(registry_.collectable_meshes().empty());
  ASSERT_TRUE(registry_.add_mesh("m", mesh_).ok());
  EXPECT_TRUE(registry_.collectable_meshes().empty()) << "this is another mesh";
}

TEST_F(RegistryTest, AMeshIsDeletedConditionallyOnlyIfItIsUnusedAndTheConditionHolds) {
  mesh_ = *registry_.add_mesh("m", mesh_);
  const ScenePtr scene = created("arena");
  ASSERT_TRUE(scene->change_instances(placing(placement({1}, {0, 0, 0}))).ok());
  EXPECT_FALSE(*registry_.delete_mesh_if(mesh_, [] { return true; })) << "an instance uses it";
  StaticChange removal;
  removal.remove_ids = columns_.ids({1});
  ASSERT_TRUE(scene->change_instances(removal).ok());
  EXPECT_FALSE(*registry_.delete_mesh_if(mesh_, [] { return false; }));
  EXPECT_TRUE(registry_.find_mesh("m", "mesh").ok());
  EXPECT_TRUE(*registry_.delete_mesh_if(mesh_, [] { return true; }));
  EXPECT_EQ(registry_.find_mesh("m", "mesh").status().code(), absl::StatusCode::kNotFound);
  const MeshPtr again = *registry_.add_mesh("m", make_mesh("m", 1));
  EXPECT_FALSE(*registry_.delete_mesh_if(mesh_, [] { return true; })) << "this is another mesh";
  EXPECT_EQ(*registry_.find_mesh("m", "mesh"), again);
}

TEST_F(RegistryTest, TheHistoryUsesItsMeshesUntilItsTicksAreDropped) {
  mesh_ = *registry_.add_mesh("m", mesh_);
  SceneSpec spec;
  spec.history = {2, 1u << 20};
  const ScenePtr scene = registry_.create_scene("arena", spec, 1, "", false)->scene;
  EXPECT_TRUE(registry_.used_meshes().empty());
  ASSERT_TRUE(scene->change_instances(placing(placement({1}, {0, 0, 0}))).ok());
  EXPECT_TRUE(registry_.used_meshes().contains(mesh_.get()));
  const auto begin_tick = [&](uint64_t tick) {
    UpdateBatch batch;
    batch.tick = tick;
    EXPECT_TRUE(scene->apply(batch).ok());
  };
  begin_tick(1);
  StaticChange removal;
  removal.remove_ids = columns_.ids({1});
  ASSERT_TRUE(scene->change_instances(removal).ok());
  EXPECT_TRUE(registry_.used_meshes().contains(mesh_.get())) << "tick 0 has the instance";
  begin_tick(2);
  EXPECT_TRUE(registry_.used_meshes().contains(mesh_.get()));
  begin_tick(4);
  EXPECT_FALSE(registry_.used_meshes().contains(mesh_.get()));
}

TEST_F(RegistryTest, MeshesAreListedByNamePageByPageWithTheirUses) {
  for (uint8_t i = 3; i > 0; --i) {
    const std::string name(1, static_cast<char>('a' + i));
    ASSERT_TRUE(registry_.add_mesh(name, make_mesh(name, i)).ok());
  }
  mesh_ = *registry_.find_mesh("c", "mesh");
  ASSERT_TRUE(created("a")->change_instances(placing(placement({1}, {0, 0, 0}))).ok());
  const std::vector<Registry::NamedMesh> page = registry_.list_meshes("b", 5);
  ASSERT_EQ(page.size(), 2u);
  EXPECT_EQ(page[0].name, "c");
  EXPECT_EQ(page[0].uses, 1u);
  EXPECT_EQ(page[1].name, "d");
  EXPECT_EQ(page[1].uses, 0u);
  EXPECT_EQ(registry_.list_meshes("", 2).size(), 2u);
}

TEST_F(RegistryTest, AMeshInUseOutlivesItsRegistry) {
  ScenePtr scene;
  {
    Registry registry;
    ASSERT_TRUE(registry.add_mesh("m", mesh_).ok());
    scene = registry.create_scene("a", {}, 1, "", false)->scene;
    ASSERT_TRUE(scene->change_instances(placing(placement({1}, {0, 0, 0}))).ok());
  }
  mesh_.reset();
  EXPECT_EQ(scene->latest()->statics->find(1)->mesh->triangle_count(), 1u);
}

}  // namespace
}  // namespace locus::test
