#include "client/embedded/embedded_server.h"

#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/lib/move_batcher.h"
#include "client/lib/query_batcher.h"
#include "client/lib/query_builder.h"
#include "client/lib/result_rows.h"
#include "client/lib/status.h"
#include "client/lib/update_builder.h"
#include "tests/support/daemon_process.h"

// Clang has no macro for the sanitizer, but a test for features.
#if defined(__has_feature)
#define LOCUS_ADDRESS_SANITIZER __has_feature(address_sanitizer)
#else
#define LOCUS_ADDRESS_SANITIZER 0
#endif

namespace locus::client {
namespace {

using test::DaemonProcess;
using test::TemporaryFolder;
using ::testing::ElementsAre;

constexpr uint32_t kThreads = 2;

// A real server and a client of it.
class Served {
 public:
  virtual ~Served() = default;
  Client& client() { return *client_; }

 protected:
  std::unique_ptr<Client> client_;
};

class ServedInProcess final : public Served {
 public:
  ServedInProcess() {
    absl::StatusOr<std::unique_ptr<EmbeddedServer>> started = EmbeddedServer::start({.threads = kThreads});
    EXPECT_TRUE(started.ok()) << started.status();
    server_ = *std::move(started);
    client_ = server_->connect();
  }

 private:
  std::unique_ptr<EmbeddedServer> server_;
};

class ServedByDaemon final : public Served {
 public:
  ServedByDaemon()
      : daemon_({"--listen", "127.0.0.1:0", "--port-file", folder_.file("port"), "--http-listen", "", "--threads",
                 absl::StrCat(kThreads)},
                folder_.file("log")) {
    const int port = DaemonProcess::wait_for_port(folder_.file("port"));
    absl::StatusOr<std::unique_ptr<Client>> client = Client::connect(absl::StrCat("127.0.0.1:", port));
    EXPECT_TRUE(client.ok()) << client.status();
    client_ = *std::move(client);
  }

 private:
  TemporaryFolder folder_;
  DaemonProcess daemon_;
};

enum class Place { kLoopback, kEmbedded };

std::unique_ptr<Served> serve(Place place) {
  if (place == Place::kLoopback) return std::make_unique<ServedByDaemon>();
  return std::make_unique<ServedInProcess>();
}

void create(Client& client, const std::string& scene) {
  v1::CreateSceneRequest request;
  request.set_name(scene);
  ASSERT_TRUE(client.create_scene(request).ok());
}

v1::QueryBatch ray_down(float x, Revision at_least = {}) {
  QueryBuilder builder;
  if (at_least.epoch != 0) builder.at_least(at_least);
  builder.rays().ray({x, 0, 100}, {0, 0, -1});
  return builder.build();
}

// Tests that pass over a socket and in process alike, because the same server answers.
class BothPlacesTest : public ::testing::TestWithParam<Place> {
 protected:
  void SetUp() override {
    served_ = serve(GetParam());
    create(client(), "arena");
  }
  Client& client() { return served_->client(); }

  std::unique_ptr<Served> served_;
};

TEST_P(BothPlacesTest, TheServerDescribesItselfAndIsHealthy) {
  const absl::StatusOr<v1::GetServerResponse> server = client().get_server();
  ASSERT_TRUE(server.ok()) << server.status();
  EXPECT_THAT(server->features(), ::testing::Contains("rays"));
  EXPECT_EQ(client().health().value(), Health::kServing);
}

TEST_P(BothPlacesTest, AnInsertedBallIsHitAndAMovedOneIsHitElsewhere) {
  UpdateBuilder updates;
  updates.insert_ball(8, Float3{0, 0, 40}, 0.5f);
  const absl::StatusOr<v1::UpdateAck> ack = client().apply("arena", updates.build());
  ASSERT_TRUE(ack.ok()) << ack.status();
  const absl::StatusOr<v1::QueryResult> first = client().query("arena", ray_down(0, {ack->epoch(), ack->revision()}));
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(RayHits::of(first->blocks(0))->id(0), 8u);
  EXPECT_FLOAT_EQ(RayHits::of(first->blocks(0))->t(0), 59.5f);
  UpdateBuilder moves;
  moves.move(8, Float3{5, 0, 40});
  const absl::StatusOr<v1::UpdateAck> moved = client().apply("arena", moves.build());
  ASSERT_TRUE(moved.ok()) << moved.status();
  EXPECT_EQ(RayHits::of(client().query("arena", ray_down(0))->blocks(0))->id(0), 0u);
  EXPECT_EQ(RayHits::of(client().query("arena", ray_down(5))->blocks(0))->id(0), 8u);
}

TEST_P(BothPlacesTest, StreamsAckAndAnswerEveryBatch) {
  constexpr uint64_t kBatches = 300;
  const std::unique_ptr<UpdateStream> updates = client().update_stream("arena");
  const std::unique_ptr<QueryStream> queries = client().query_stream("arena");
  std::vector<std::future<absl::StatusOr<v1::UpdateAck>>> acks;
  std::vector<std::future<absl::StatusOr<v1::QueryResult>>> answers;
  for (uint64_t id = 1; id <= kBatches; ++id) {
    UpdateBuilder update;
    update.insert_ball(id, Float3{3 * static_cast<float>(id), 0, 0}, 1.0f);
    acks.push_back(updates->send(update.build()));
    answers.push_back(queries->send(ray_down(3)));
  }
  for (uint64_t batch = 1; batch <= kBatches; ++batch) {
    const absl::StatusOr<v1::UpdateAck> ack = acks[batch - 1].get();
    ASSERT_TRUE(ack.ok()) << ack.status();
    EXPECT_EQ(ack->revision(), batch);
    EXPECT_TRUE(answers[batch - 1].get().ok());
  }
  EXPECT_TRUE(updates->close().ok());
  EXPECT_TRUE(queries->close().ok());
}

TEST_P(BothPlacesTest, BatchersGatherMovesAndQueries) {
  UpdateBuilder updates;
  for (uint64_t id = 1; id <= 50; ++id) updates.insert_ball(id, Float3{0, 0, 0}, 1.0f);
  ASSERT_TRUE(client().apply("arena", updates.build()).ok());
  MoveBatcher moves(client().update_stream("arena"), {.max_items = 16});
  for (uint64_t id = 1; id <= 50; ++id) moves.move(id, Float3{3 * static_cast<float>(id), 0, 0});
  ASSERT_TRUE(moves.flush().ok());
  std::vector<uint64_t> ids;
  {
    QueryBatcher batcher(client().query_stream("arena"), {});
    for (uint64_t id = 1; id <= 50; ++id)
      batcher.ray({.origin = {3 * static_cast<float>(id), 0, 9}, .direction = {0, 0, -1}},
                  [&ids](absl::StatusOr<SingleHit> hit) { ids.push_back(hit.ok() ? hit->id : 0); });
  }
  ASSERT_EQ(ids.size(), 50u);
  EXPECT_EQ(std::set<uint64_t>(ids.begin(), ids.end()).size(), 50u);
  EXPECT_EQ(*std::max_element(ids.begin(), ids.end()), 50u);
}

TEST_P(BothPlacesTest, AMeshIsUploadedPlacedHitDumpedAndDownloaded) {
  const std::vector<float> vertices = {-1, -1, 0, 1, -1, 0, 0, 1, 0};
  const std::vector<uint32_t> indices = {0, 1, 2};
  for (const bool is_known : {false, true}) {
    const absl::StatusOr<v1::UploadMeshResponse> uploaded =
        client().upload_mesh({.name = "leaf", .vertices = vertices, .indices = indices});
    ASSERT_TRUE(uploaded.ok()) << uploaded.status();
    EXPECT_EQ(uploaded->already_known(), is_known);
  }
  v1::ChangeInstancesRequest change;
  change.set_scene("arena");
  v1::Placement& placement = *change.add_place();
  placement.set_mesh("leaf");
  placement.add_ids(77);
  for (const double value : {0.0, 0.0, 20.0}) placement.add_translations(value);
  ASSERT_TRUE(client().change_instances(change).ok());
  const absl::StatusOr<v1::QueryResult> result = client().query("arena", ray_down(0));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(RayHits::of(result->blocks(0))->id(0), 77u);
  v1::DumpSceneRequest dump;
  dump.set_scene("arena");
  int messages = 0;
  EXPECT_TRUE(
      client().dump(dump, [&messages](const v1::DumpSceneResponse&) { return ++messages, absl::OkStatus(); }).ok());
  EXPECT_GT(messages, 0);
  const absl::StatusOr<DownloadedMesh> mesh = client().download_mesh("leaf");
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertices, vertices);
}

TEST_P(BothPlacesTest, ARefusalNamesItsFieldAndALateQueryItsRevision) {
  QueryBuilder wrong;
  wrong.rays().ray({0, 0, 0}, {0, 0, 0});
  const absl::Status refused = client().query("arena", wrong.build()).status();
  ASSERT_TRUE(error_of(refused).has_value()) << refused;
  EXPECT_EQ(error_of(refused)->field(), "blocks[0].rays.directions");
  const uint64_t epoch = client().get_scene("arena")->epoch();
  v1::QueryBatch future = ray_down(0, {epoch, 9});
  future.mutable_view()->set_at_least(9);
  EXPECT_TRUE(absl::IsNotFound(client().query("nowhere", ray_down(0)).status()));
  const std::unique_ptr<QueryStream> stream = client().query_stream("arena");
  EXPECT_FALSE(stream->send(std::move(future)).get().ok()) << "waits a second for a revision that does not come";
}

TEST_P(BothPlacesTest, LargeMessagesPass) {
  constexpr uint64_t kBalls = 200'000;
  UpdateBuilder updates;
  for (uint64_t id = 1; id <= kBalls; ++id)
    updates.insert_ball(id, Float3{static_cast<float>(id % 1000), static_cast<float>(id / 1000), 0}, 0.1f);
  const absl::StatusOr<v1::UpdateAck> ack = client().apply("arena", updates.build());
  ASSERT_TRUE(ack.ok()) << ack.status();
  EXPECT_EQ(ack->applied(), kBalls);
}

INSTANTIATE_TEST_SUITE_P(Places, BothPlacesTest, ::testing::Values(Place::kLoopback, Place::kEmbedded),
                         [](const auto& place) { return place.param == Place::kLoopback ? "Loopback" : "Embedded"; });

std::unique_ptr<EmbeddedServer> start(const EmbeddedOptions& options = {}) {
  absl::StatusOr<std::unique_ptr<EmbeddedServer>> server = EmbeddedServer::start(options);
  EXPECT_TRUE(server.ok()) << server.status();
  return *std::move(server);
}

// Makes a scene of balls and triangles from a fixed seed.
void fill(Client& client) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> place(-50, 50);
  create(client, "world");
  UpdateBuilder updates;
  for (uint64_t id = 1; id <= 5000; ++id)
    updates.insert_ball(id, Float3{place(random), place(random), place(random)}, 0.5f);
  ASSERT_TRUE(client.apply("world", updates.build()).ok());
  std::vector<float> vertices(3 * 3000);
  for (float& value : vertices) value = place(random);
  std::vector<uint32_t> indices(vertices.size() / 3);
  for (size_t i = 0; i < indices.size(); ++i) indices[i] = static_cast<uint32_t>(i);
  ASSERT_TRUE(client.upload_mesh({.name = "soup", .vertices = vertices, .indices = indices}).ok());
  v1::ChangeInstancesRequest change;
  change.set_scene("world");
  v1::Placement& placement = *change.add_place();
  placement.set_mesh("soup");
  placement.add_ids(9999);
  for (int axis = 0; axis < 3; ++axis) placement.add_translations(1.0);
  ASSERT_TRUE(client.change_instances(change).ok());
}

v1::QueryBatch many_rays(size_t count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-50, 50);
  QueryBuilder builder;
  RayBlock rays = builder.rays();
  for (size_t i = 0; i < count; ++i)
    rays.ray({place(random), place(random), place(random)}, {place(random), place(random), place(random)});
  return builder.build();
}

// Returns the bytes of the result blocks, which do not contain the scene's random epoch.
std::string blocks_of(const absl::StatusOr<v1::QueryResult>& result) {
  EXPECT_TRUE(result.ok()) << result.status();
  std::string bytes;
  for (const v1::BlockResult& block : result->blocks()) bytes += block.SerializeAsString();
  return bytes;
}

TEST(EmbeddedServerTest, AnswersAreByteForByteThoseOfADaemon) {
  const auto embedded = serve(Place::kEmbedded), loopback = serve(Place::kLoopback);
  fill(embedded->client());
  fill(loopback->client());
  for (const size_t count : {1u, 1024u, 8192u}) {
    const std::string bytes = blocks_of(embedded->client().query("world", many_rays(count)));
    EXPECT_GT(bytes.size(), 16 * count);
    EXPECT_EQ(bytes, blocks_of(loopback->client().query("world", many_rays(count)))) << count;
    EXPECT_EQ(bytes, blocks_of(embedded->client().query_stream("world")->send(many_rays(count)).get())) << count;
  }
}

TEST(EmbeddedServerTest, StartsAndEndsManyTimesInOneProcess) {
  for (int round = 0; round < 30; ++round) {
    const std::unique_ptr<EmbeddedServer> server = start({.threads = kThreads});
    const std::unique_ptr<Client> client = server->connect();
    create(*client, "arena");
    EXPECT_EQ(client->list_scenes()->size(), 1u) << round;
  }
}

TEST(EmbeddedServerTest, ServersOfOneProcessShareNothing) {
  const std::unique_ptr<EmbeddedServer> one = start(), other = start();
  const std::unique_ptr<Client> client = one->connect(), stranger = other->connect();
  create(*client, "arena");
  EXPECT_EQ(client->list_scenes()->size(), 1u);
  EXPECT_EQ(stranger->list_scenes()->size(), 0u);
}

TEST(EmbeddedServerTest, ClientsOfManyThreadsShareAServer) {
  const std::unique_ptr<EmbeddedServer> server = start();
  fill(*server->connect());
  const std::string wanted = blocks_of(server->connect()->query("world", many_rays(64)));
  std::vector<std::thread> threads;
  for (int thread = 0; thread < 8; ++thread)
    threads.emplace_back([&] {
      const std::unique_ptr<Client> client = server->connect();
      for (int call = 0; call < 50; ++call) EXPECT_EQ(blocks_of(client->query("world", many_rays(64))), wanted);
    });
  for (std::thread& thread : threads) thread.join();
}

TEST(EmbeddedServerTest, AClientThatOutlivesItsServerGetsUnavailable) {
  std::unique_ptr<EmbeddedServer> server = start();
  ClientOptions once;
  once.retry.max_attempts = 1;
  const std::unique_ptr<Client> client = server->connect(once);
  create(*client, "arena");
  const std::unique_ptr<QueryStream> stream = client->query_stream("arena", {.reconnect = {.max_attempts = 1}});
  EXPECT_TRUE(stream->send(ray_down(0)).get().ok());
  server.reset();
  EXPECT_TRUE(absl::IsUnavailable(client->get_server().status()));
  EXPECT_FALSE(stream->send(ray_down(0)).get().ok());
}

TEST(EmbeddedServerTest, CallsThatRunWhenTheServerEndsAreEnded) {
  std::unique_ptr<EmbeddedServer> server = start();
  ClientOptions once;
  once.retry.max_attempts = 1;
  const std::unique_ptr<Client> client = server->connect(once);
  create(*client, "arena");
  const v1::QueryBatch never = ray_down(0, {client->get_scene("arena")->epoch(), 1});
  std::future<absl::Status> waiting =
      std::async(std::launch::async, [&] { return client->query("arena", never).status(); });
  // Two calls are open: the waiting one, and the one that counts.
  const auto open_calls = [&] {
    const absl::StatusOr<v1::GetServerResponse> described = client->get_server();
    for (const v1::Limit& limit : described->limits())
      if (limit.name() == "calls") return limit.used();
    return 0.0;
  };
  while (open_calls() < 2) std::this_thread::yield();
  server.reset();
  EXPECT_FALSE(waiting.get().ok());
}

TEST(EmbeddedServerTest, ScenesInADataDirectoryOutliveTheServer) {
  const TemporaryFolder folder;
  const EmbeddedOptions options{.data_dir = folder.file("data")};
  {
    const std::unique_ptr<EmbeddedServer> server = start(options);
    create(*server->connect(), "arena");
    UpdateBuilder updates;
    updates.insert_ball(8, Float3{0, 0, 40}, 0.5f);
    ASSERT_TRUE(server->connect()->apply("arena", updates.build()).ok());
    const absl::Status second = EmbeddedServer::start(options).status();
    EXPECT_TRUE(absl::IsFailedPrecondition(second)) << second;
  }
  const std::unique_ptr<EmbeddedServer> server = start(options);
  EXPECT_EQ(RayHits::of(server->connect()->query("arena", ray_down(0))->blocks(0))->id(0), 8u);
}

TEST(EmbeddedServerTest, CallersInTheProcessAreOnePeerWithAName) {
  const std::unique_ptr<EmbeddedServer> server = start();
  const absl::StatusOr<std::vector<v1::IdentityQuotas>> quotas = server->connect()->get_quotas();
  ASSERT_TRUE(quotas.ok()) << quotas.status();
  std::vector<std::string> names;
  for (const v1::IdentityQuotas& entry : *quotas) names.push_back(entry.identity());
  EXPECT_THAT(names, ElementsAre("anonymous", "connection:in-process"));
}

TEST(EmbeddedServerTest, MessageSizesFollowTheClientsOptions) {
  const std::unique_ptr<EmbeddedServer> server = start();
  ClientOptions small;
  small.max_send_bytes = 1000;
  const std::unique_ptr<Client> client = server->connect(small);
  create(*client, "arena");
  EXPECT_TRUE(absl::IsResourceExhausted(client->query("arena", many_rays(1024)).status()));
}

// State of a process that a library should leave alone.
struct HostState {
  std::array<struct sigaction, 32> actions{};
  sigset_t mask{};
  std::array<rlim_t, RLIM_NLIMITS> limits{};
  size_t sockets = 0;
  std::string filters;
};

HostState host_state() {
  HostState state;
  for (int signal = 1; signal < 32; ++signal) sigaction(signal, nullptr, &state.actions[static_cast<size_t>(signal)]);
  pthread_sigmask(SIG_SETMASK, nullptr, &state.mask);
  for (int which = 0; which < RLIM_NLIMITS; ++which) {
    rlimit limit{};
    getrlimit(static_cast<__rlimit_resource>(which), &limit);
    state.limits[static_cast<size_t>(which)] = limit.rlim_cur;
  }
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code ignored;
    state.sockets += absl::StartsWith(std::filesystem::read_symlink(entry.path(), ignored).string(), "socket:");
  }
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (absl::StartsWith(line, "Seccomp") || absl::StartsWith(line, "NoNewPrivs")) state.filters += line;
  return state;
}

TEST(EmbeddedServerTest, TheRestOfTheProcessIsLeftAlone) {
  const HostState before = host_state();
  ::testing::internal::CaptureStdout();
  {
    const TemporaryFolder folder;
    const std::unique_ptr<EmbeddedServer> server = start({.data_dir = folder.file("data")});
    create(*server->connect(), "arena");
    const HostState during = host_state();
    for (size_t signal = 1; signal < 32; ++signal)
      EXPECT_EQ(during.actions[signal].sa_handler, before.actions[signal].sa_handler) << signal;
    for (int signal = 1; signal < 32; ++signal)
      EXPECT_EQ(sigismember(&during.mask, signal), sigismember(&before.mask, signal)) << signal;
    EXPECT_EQ(during.limits, before.limits);
    EXPECT_EQ(during.sockets, before.sockets) << "no port and no other socket";
    EXPECT_EQ(during.filters, before.filters) << "no filter of system calls";
  }
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
}

TEST(EmbeddedServerTest, FunctionsOfTheSystemAreNotReplaced) {
#if defined(__SANITIZE_ADDRESS__) || LOCUS_ADDRESS_SANITIZER
  GTEST_SKIP() << "AddressSanitizer replaces functions of the system, too";
#endif
  Dl_info owner{};
  ASSERT_NE(dladdr(dlsym(RTLD_DEFAULT, "recvmsg"), &owner), 0);
  EXPECT_THAT(std::string(owner.dli_fname), ::testing::HasSubstr("libc")) << "the functions of locusd that replace it";
}

}  // namespace
}  // namespace locus::client
