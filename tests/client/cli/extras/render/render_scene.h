// Small deterministic scenes on a real server inside the test's process, for tests of `locus render`.
#ifndef LOCUS_TESTS_CLIENT_CLI_EXTRAS_RENDER_RENDER_SCENE_H_
#define LOCUS_TESTS_CLIENT_CLI_EXTRAS_RENDER_RENDER_SCENE_H_

#include <gtest/gtest.h>

#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "client/cli/context.h"
#include "client/cli/levels/generate/city.h"
#include "client/cli/run.h"
#include "client/lib/client.h"
#include "client/lib/update_builder.h"
#include "tests/support/running_server.h"

namespace locus::cli {

struct Outcome {
  ExitCode code;
  std::string out;
  std::string err;
};

class RenderServer {
 public:
  explicit RenderServer(uint32_t threads = 2) : running_(config_of(threads)) {
    absl::StatusOr<std::unique_ptr<client::Client>> connected = client::Client::connect(running_.address());
    LOCUS_CHECK(connected.ok());
    client_ = *std::move(connected);
  }

  const client::Client& client() const { return *client_; }

  Outcome run(std::vector<std::string> arguments, Progress progress = Progress::kSilent) {
    arguments.insert(arguments.begin(), {"--address", running_.address()});
    std::ostringstream out, err;
    Context context(out, err, progress);
    const ExitCode code = run_line(arguments, context);
    return {code, out.str(), err.str()};
  }

  void create(const std::string& scene) {
    v1::CreateSceneRequest request;
    request.set_name(scene);
    EXPECT_TRUE(client_->create_scene(request).ok());
  }

  void apply(const std::string& scene, client::UpdateBuilder& updates) {
    const absl::StatusOr<v1::UpdateAck> ack = client_->apply(scene, updates.build());
    ASSERT_TRUE(ack.ok()) << ack.status();
    EXPECT_EQ(ack->refused(), 0u);
  }

  // Uploads a city of about `triangles` triangles and returns the mesh's name, which contains that number.
  std::string upload_city(uint64_t triangles) {
    const ImportedMesh city = generate_city(triangles, 7);
    const std::string name = "city-" + std::to_string(triangles);
    EXPECT_TRUE(client_->upload_mesh({.name = name, .vertices = city.vertices, .indices = city.indices}).ok());
    return name;
  }

  void place(const std::string& scene, uint64_t id, const std::string& mesh, const client::Double3& at,
             const client::Rotation& rotation = {}, float scale = 1) {
    v1::ChangeInstancesRequest change;
    change.set_scene(scene);
    v1::Placement& placement = *change.add_place();
    placement.set_mesh(mesh);
    placement.add_ids(id);
    for (const double coordinate : {at.x, at.y, at.z}) placement.add_translations(coordinate);
    for (const float part : {rotation.x, rotation.y, rotation.z, rotation.w}) placement.add_rotations(part);
    placement.add_scales(scale);
    const auto placed = client_->change_instances(change);
    EXPECT_TRUE(placed.ok()) << placed.status();
  }

  client::Revision revision(const std::string& scene) {
    const absl::StatusOr<v1::Scene> found = client_->get_scene(scene);
    EXPECT_TRUE(found.ok());
    return {found->epoch(), found->revision()};
  }

 private:
  static server::ServerConfig config_of(uint32_t threads) {
    server::ServerConfig config = test::test_config();
    config.threads = threads;
    return config;
  }

  test::RunningServer running_;
  std::unique_ptr<client::Client> client_;
};

}  // namespace locus::cli

#endif  // LOCUS_TESTS_CLIENT_CLI_EXTRAS_RENDER_RENDER_SCENE_H_
