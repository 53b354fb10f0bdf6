#include "server/scheduling/mesh_collector.h"

#include <gmock/gmock.h>

#include <atomic>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/memory_log.h"
#include "tests/support/scene_fixture.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Time = LifetimeKeeper::Time;

// A grace of 8 s, so that meshes in use are checked every second.
constexpr uint32_t kGrace = 8;

const MeshCollector::Reports kNoReports = {[](const std::string&, const absl::Status&) {},
                                           [](const Scene&, const absl::Status&) {}};

class MeshCollectorTest : public ::testing::Test {
 protected:
  MeshCollectorTest() { collector_.start(); }

  ScenePtr created(const std::string& name, uint32_t mesh_grace_s = kGrace, const std::string& static_from = "",
                   HistoryOptions history = {}) {
    SceneSpec spec;
    spec.mesh_grace_s = mesh_grace_s;
    spec.history = history;
    const auto created = registry_.create_scene(name, spec, ++epoch_, static_from, false);
    EXPECT_TRUE(created.ok()) << created.status();
    collector_.instances_changed(*created->scene);
    return created->scene;
  }
  MeshPtr upload(const std::string& name, uint8_t content) {
    collector_.renew(name);
    return *registry_.add_mesh(name, test::make_mesh(name, content));
  }
  // Does what the server does for a call that changes instances.
  static absl::Status change(Scene& scene, MeshCollector& collector, const StaticChange& change) {
    for (const PlacementColumns& place : change.place) collector.renew(place.mesh->name());
    const absl::Status status = scene.change_instances(change).status();
    collector.instances_changed(scene);
    return status;
  }
  void place(Scene& scene, const MeshPtr& mesh, Id id) {
    test::Columns columns;
    StaticChange placing;
    PlacementColumns& place = placing.place.emplace_back();
    place.mesh = mesh;
    place.ids = columns.ids({id});
    place.translations = columns.doubles({0, 0, 0});
    ASSERT_TRUE(change(scene, collector_, placing).ok());
  }
  void remove(Scene& scene, Id id) {
    test::Columns columns;
    StaticChange removal;
    removal.remove_ids = columns.ids({id});
    ASSERT_TRUE(change(scene, collector_, removal).ok());
  }
  static void begin_tick(Scene& scene, uint64_t tick) {
    UpdateBatch batch;
    batch.tick = tick;
    ASSERT_TRUE(scene.apply(batch).ok());
  }
  // Advances the clock to `ms`, calls the tasks that become due on the way, each at its time, and returns the names of
  // the meshes that exist then.
  std::vector<std::string> meshes_at(int64_t ms) {
    for (; now_ < Time(seconds(1000) + milliseconds(ms)); now_ += milliseconds(100)) keeper_.run_due();
    keeper_.run_due();
    std::vector<std::string> names;
    for (const Registry::NamedMesh& mesh : registry_.list_meshes("", 100)) names.push_back(mesh.name);
    return names;
  }

  Time now_ = Time(seconds(1000));
  test::MemoryLog log_;
  Registry registry_{&log_};
  LifetimeKeeper keeper_{[this] { return now_; }};
  std::vector<std::string> reports_;
  MeshCollector collector_{keeper_, registry_,
                           MeshCollector::Reports{[this](const std::string& mesh, const absl::Status& status) {
                                                    reports_.push_back(mesh + (status.ok() ? "" : " failed"));
                                                  },
                                                  [this](const Scene& scene, const absl::Status&) {
                                                    reports_.push_back(scene.name() + " not marked");
                                                  }}};
  uint64_t epoch_ = 0;
};

TEST_F(MeshCollectorTest, AMeshIsDeletedItsGraceAfterItsLastInstanceWasRemoved) {
  const ScenePtr scene = created("arena");
  place(*scene, upload("m", 1), 1);
  EXPECT_THAT(meshes_at(20'500), ElementsAre("m"));
  remove(*scene, 1);
  EXPECT_THAT(meshes_at(28'400), ElementsAre("m")) << "never earlier than its grace";
  EXPECT_THAT(meshes_at(29'500), IsEmpty()) << "and at most an eighth later";
  EXPECT_THAT(reports_, ElementsAre("m"));
  EXPECT_EQ(collector_.deleted(), 1u);
  EXPECT_THAT(log_.crash().meshes, IsEmpty()) << "the deletion is durable";
}

TEST_F(MeshCollectorTest, NoMeshIsDeletedWhileASceneIsDamaged) {
  const ScenePtr scene = created("arena");
  place(*scene, upload("m", 1), 1);
  remove(*scene, 1);
  registry_.restore_damaged_scene("broken", 77, absl::DataLossError("damaged"));
  EXPECT_THAT(meshes_at(200'000), ElementsAre("m")) << "the damaged scene may use it";
  EXPECT_EQ(collector_.deleted(), 0u);
}

TEST_F(MeshCollectorTest, AMeshThatNoAskingSceneUsedIsNotDeleted) {
  upload("never-placed", 1);
  const ScenePtr scene = created("arena", 0);
  place(*scene, upload("m", 2), 1);
  remove(*scene, 1);
  EXPECT_THAT(meshes_at(100'000), ElementsAre("m", "never-placed"));
}

TEST_F(MeshCollectorTest, AMeshThatAnySceneUsesIsNotDeleted) {
  const ScenePtr asking = created("asking");
  const ScenePtr other = created("other", 0);
  const MeshPtr mesh = upload("m", 1);
  place(*asking, mesh, 1);
  place(*other, mesh, 1);
  ASSERT_TRUE(registry_.delete_scene("asking").ok());
  EXPECT_THAT(meshes_at(50'000), ElementsAre("m"));
  ASSERT_TRUE(registry_.delete_scene("other").ok());
  EXPECT_THAT(meshes_at(57'900), ElementsAre("m"));
  EXPECT_THAT(meshes_at(59'000), IsEmpty());
}

TEST_F(MeshCollectorTest, ASceneThatSharesTheInstancesOfAnotherAsksForItsMeshes) {
  const ScenePtr source = created("source", 0);
  place(*source, upload("m", 1), 1);
  created("copy", kGrace, "source");
  ASSERT_TRUE(registry_.delete_scene("copy").ok());
  EXPECT_THAT(meshes_at(20'000), ElementsAre("m"));
  ASSERT_TRUE(registry_.delete_scene("source").ok());
  EXPECT_THAT(meshes_at(30'000), IsEmpty());
}

TEST_F(MeshCollectorTest, TheHistoryUsesAMesh) {
  const ScenePtr scene = created("arena", kGrace, "", {2, 1u << 20});
  place(*scene, upload("m", 1), 1);
  begin_tick(*scene, 1);
  remove(*scene, 1);
  EXPECT_THAT(meshes_at(50'000), ElementsAre("m"));
  begin_tick(*scene, 4);
  EXPECT_THAT(meshes_at(57'900), ElementsAre("m"));
  EXPECT_THAT(meshes_at(59'000), IsEmpty());
}

TEST_F(MeshCollectorTest, AMeshOfAChangeThatWaitsLongerThanTheGraceIsNotDeleted) {
  const ScenePtr scene = created("arena");
  const MeshPtr mesh = upload("m", 1);
  place(*scene, mesh, 1);
  remove(*scene, 1);
  test::Columns columns;
  StaticChange waiting;
  waiting.place.resize(2);
  for (PlacementColumns& place : waiting.place) {
    place.mesh = mesh;
    place.translations = columns.doubles({0, 0, 0});
  }
  std::optional<Scene::ExpectedMeshes> expected(std::in_place, scene, waiting);
  EXPECT_THAT(meshes_at(50'000), ElementsAre("m"));
  EXPECT_EQ(registry_.delete_mesh("m").code(), absl::StatusCode::kFailedPrecondition);
  const absl::StatusOr<InstanceChange> placed = scene->change_instances(waiting);
  ASSERT_TRUE(placed.ok()) << placed.status();
  StaticChange removal;
  removal.remove_ids = placed->placed;
  ASSERT_TRUE(scene->change_instances(removal).ok());
  EXPECT_THAT(meshes_at(70'000), ElementsAre("m")) << "the waiting change has not been released";
  expected.reset();
  EXPECT_THAT(meshes_at(77'900), ElementsAre("m"));
  EXPECT_THAT(meshes_at(80'000), IsEmpty());
}

TEST_F(MeshCollectorTest, PlacingOrUploadingAMeshBeginsItsTimeAgain) {
  const ScenePtr scene = created("arena");
  const MeshPtr mesh = upload("m", 1);
  place(*scene, mesh, 1);
  remove(*scene, 1);
  EXPECT_THAT(meshes_at(7'900), ElementsAre("m"));
  upload("m", 1);
  EXPECT_THAT(meshes_at(15'800), ElementsAre("m"));
  place(*scene, mesh, 1);
  EXPECT_THAT(meshes_at(30'050), ElementsAre("m"));
  remove(*scene, 1);
  place(*scene, mesh, 1);
  remove(*scene, 1);
  EXPECT_THAT(meshes_at(38'000), ElementsAre("m"));
  EXPECT_THAT(meshes_at(40'000), IsEmpty());
}

TEST_F(MeshCollectorTest, AMeshThatIsPlacedAndRemovedBetweenTwoChecksHasItsWholeTime) {
  const ScenePtr scene = created("arena", 80);
  const MeshPtr mesh = upload("m", 1);
  place(*scene, mesh, 1);
  remove(*scene, 1);
  EXPECT_THAT(meshes_at(60'000), ElementsAre("m"));
  place(*scene, mesh, 1);
  EXPECT_THAT(meshes_at(65'000), ElementsAre("m"));
  remove(*scene, 1);
  EXPECT_THAT(meshes_at(144'900), ElementsAre("m"));
  EXPECT_THAT(meshes_at(156'000), IsEmpty());
}

TEST_F(MeshCollectorTest, ALaterMeshOfTheNameIsAnotherMesh) {
  const ScenePtr scene = created("arena");
  place(*scene, upload("m", 1), 1);
  remove(*scene, 1);
  EXPECT_THAT(meshes_at(4'000), ElementsAre("m"));
  ASSERT_TRUE(registry_.delete_mesh("m").ok());
  upload("m", 2);
  EXPECT_THAT(meshes_at(100'000), ElementsAre("m"));
}

TEST_F(MeshCollectorTest, AFailedDeletionIsTriedAgain) {
  const ScenePtr scene = created("arena");
  place(*scene, upload("m", 1), 1);
  remove(*scene, 1);
  log_.fail_with(absl::ResourceExhaustedError("the disk is full"));
  EXPECT_THAT(meshes_at(12'000), ElementsAre("m"));
  EXPECT_THAT(reports_, ElementsAre("m failed"));
  log_.fail_with(absl::OkStatus());
  EXPECT_THAT(meshes_at(16'000), IsEmpty());
}

TEST_F(MeshCollectorTest, AllMeshesOfASceneAreMarkedWithOneWrite) {
  const ScenePtr scene = created("arena");
  test::Columns columns;
  StaticChange placing;
  for (uint8_t i = 0; i < 5; ++i) {
    PlacementColumns& place = placing.place.emplace_back();
    place.mesh = upload("m" + std::to_string(i), i);
    place.translations = columns.doubles({0, 0, 0});
  }
  ASSERT_TRUE(change(*scene, collector_, placing).ok());
  EXPECT_EQ(log_.crash().mesh_graces.size(), 5u);
  EXPECT_EQ(log_.grace_writes(), 1u);
  ASSERT_TRUE(change(*scene, collector_, placing).ok());
  EXPECT_EQ(log_.grace_writes(), 1u) << "they are marked already";
}

TEST_F(MeshCollectorTest, MarksThatFailAreReportedAsMarksAndMadeAtTheNextChange) {
  const ScenePtr scene = created("arena");
  const MeshPtr mesh = upload("m", 1);
  place(*scene, mesh, 1);
  const MeshPtr other = upload("other", 2);
  log_.fail_marks_with(absl::ResourceExhaustedError("the disk is full"));
  place(*scene, other, 2);
  EXPECT_THAT(reports_, ElementsAre("arena not marked"));
  EXPECT_EQ(log_.crash().mesh_graces.count("other"), 0u);
  log_.fail_marks_with(absl::OkStatus());
  remove(*scene, 1);
  EXPECT_EQ(log_.crash().mesh_graces.count("other"), 1u);
  EXPECT_THAT(reports_, ElementsAre("arena not marked"));
}

TEST_F(MeshCollectorTest, ARestartedCollectorKnowsTheMeshesAndBeginsTheirTimeAgain) {
  const ScenePtr scene = created("arena");
  place(*scene, upload("m", 1), 1);
  remove(*scene, 1);
  EXPECT_THAT(meshes_at(7'000), ElementsAre("m"));
  test::MemoryLog log(log_.crash());
  ASSERT_EQ(log.stored_meshes().size(), 1u);
  Registry registry(&log);
  registry.restore_mesh("m", test::make_mesh("m", 1), log.stored_meshes()[0].grace_s);
  LifetimeKeeper keeper([this] { return now_; });
  MeshCollector collector(keeper, registry, kNoReports);
  collector.start();
  keeper.run_due();
  now_ += milliseconds(7'900);
  keeper.run_due();
  EXPECT_EQ(registry.mesh_count(), 1u);
  now_ += milliseconds(1'100);
  keeper.run_due();
  EXPECT_EQ(registry.mesh_count(), 0u);
}

// A crash between the placement of a mesh and its mark loses the mark, which the start writes again.
TEST_F(MeshCollectorTest, TheStartMarksTheMeshesOfAskingScenes) {
  SceneSpec spec;
  spec.mesh_grace_s = kGrace;
  const ScenePtr scene = registry_.create_scene("arena", spec, 1, "", false)->scene;
  test::Columns columns;
  StaticChange placing;
  PlacementColumns& place = placing.place.emplace_back();
  place.mesh = upload("m", 1);
  place.translations = columns.doubles({0, 0, 0});
  ASSERT_TRUE(scene->change_instances(placing).ok());
  EXPECT_THAT(registry_.collectable_meshes(), IsEmpty());
  LifetimeKeeper keeper([this] { return now_; });
  MeshCollector collector(keeper, registry_, kNoReports);
  collector.start();
  EXPECT_EQ(registry_.collectable_meshes().size(), 1u);
  EXPECT_EQ(log_.crash().mesh_graces.at("m"), kGrace);
}

// At full speed: threads upload a mesh, place it and remove it while the collector deletes it whenever it is unused. A
// placement that succeeds uses a registered mesh.
TEST(MeshCollectorThreadTest, AMeshThatIsPlacedIsNeverDeleted) {
  constexpr int kThreads = 3;
  std::atomic<int64_t> now_s{1000};
  test::MemoryLog log;
  Registry registry(&log);
  LifetimeKeeper keeper([&] { return Time(seconds(now_s.load())); });
  MeshCollector collector(keeper, registry, kNoReports);
  collector.start();
  SceneSpec spec;
  spec.mesh_grace_s = 1;
  std::atomic<uint64_t> wrong{0}, placed{0};
  std::atomic<int> left{kThreads};
  std::vector<std::thread> threads;
  for (int number = 0; number < kThreads; ++number)
    threads.emplace_back([&, number] {
      const ScenePtr scene = registry.create_scene("s" + std::to_string(number), spec, 1, "", false)->scene;
      test::Columns columns;
      for (uint64_t i = 1; i <= test::scaled_count(200); ++i) {
        collector.renew("m");
        const absl::StatusOr<MeshPtr> mesh = registry.add_mesh("m", test::make_mesh("m", 1));
        StaticChange placing;
        PlacementColumns& place = placing.place.emplace_back();
        place.mesh = *mesh;
        place.ids = columns.ids({i});
        place.translations = columns.doubles({0, 0, 0});
        collector.renew("m");
        const bool is_placed = scene->change_instances(placing).ok();
        collector.instances_changed(*scene);
        now_s.fetch_add(2);
        if (!is_placed) continue;  // the mesh was deleted before
        ++placed;
        const absl::StatusOr<MeshPtr> found = registry.find_mesh("m", "mesh");
        wrong += !found.ok() || *found != *mesh;
        StaticChange removal;
        removal.remove_ids = columns.ids({i});
        wrong += !scene->change_instances(removal).ok();
        collector.instances_changed(*scene);
      }
      --left;
    });
  while (left.load() > 0) keeper.run_due();
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong.load(), 0u);
  EXPECT_GT(placed.load(), 0u);
  for (int round = 0; round < 4; ++round) {
    now_s.fetch_add(2);
    keeper.run_due();
  }
  EXPECT_EQ(registry.mesh_count(), 0u);
}

}  // namespace
}  // namespace locus::server
