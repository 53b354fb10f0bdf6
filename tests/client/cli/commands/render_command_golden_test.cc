// Pictures of generated scenes, rendered by a real server. The hits of a picture must be the same on every machine and
// with any number of threads, so hashes of the hits are compared with tests/golden/renders.txt. If a hash differs, the
// picture is kept in the build tree.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "client/cli/levels/generate/splitmix64.h"
#include "client/cli/output.h"
#include "tests/client/cli/extras/render/render_scene.h"

namespace locus::cli {
namespace {

constexpr client::Rotation kTilted = {0.18257419f, 0.36514837f, 0.54772256f, 0.73029674f};  // (1, 2, 3, 4), normalised
constexpr client::Rotation kAboutZ = {0, 0, 0.38268343f, 0.92387953f};                      // 45 degrees

// Returns inserts of 60 balls, 60 boxes and 60 capsules, spread over a square around `middle`.
client::UpdateBuilder made_objects(const client::Double3& middle, uint64_t seed) {
  client::UpdateBuilder updates;
  SplitMix64 random(seed);
  for (uint64_t i = 0; i < 180; ++i) {
    const double x = random.unit(), y = random.unit(), z = random.unit();
    const client::Double3 at = {middle.x + 120 * (x - 0.5), middle.y + 120 * (y - 0.5), middle.z + 4 + 30 * z};
    const auto size = static_cast<float>(1 + random.unit());
    if (i % 3 == 0) updates.insert_ball(1000 + i, at, size);
    if (i % 3 == 1) updates.insert_box(1000 + i, at, {size, 2 * size, 0.5f * size}, i % 2 == 0 ? kTilted : kAboutZ);
    if (i % 3 == 2) updates.insert_capsule(1000 + i, at, {0, size, size}, 0.5f * size, kTilted);
  }
  return updates;
}

void make_scene(RenderServer& server, const std::string& name) {
  server.create(name);
  const client::Double3 middle = name == "far" ? client::Double3{3.0e8, -2.5e8, 1.0e6} : client::Double3{0, 0, 0};
  const std::string mesh = name == "objects" ? "" : server.upload_city(3000);
  if (name == "tilted") {
    server.place(name, 1, mesh, middle, kTilted);
    server.place(name, 2, mesh, {60, -40, 25}, kAboutZ, 0.25f);
    server.place(name, 3, mesh, {-30, 20, 60}, {0, 1, 0, 0}, 0.5f);
  } else if (!mesh.empty()) {
    server.place(name, 1, mesh, middle);
  }
  client::UpdateBuilder objects = made_objects(middle, name.size());
  server.apply(name, objects);
}

// Hash of the depths and hash of the ids of one picture.
struct Hashes {
  std::string depth;
  std::string ids;

  friend bool operator==(const Hashes&, const Hashes&) = default;
  friend std::ostream& operator<<(std::ostream& out, const Hashes& hashes) {
    return out << "depth " << hashes.depth << " ids " << hashes.ids;
  }
};

struct GoldenPicture {
  std::string name;
  Hashes hashes;
  std::string scene;
  std::vector<std::string> options;  // of `locus render`
};

// Reads tests/golden/renders.txt: a picture a line, with its name, the hashes of its depths and ids, its scene, and
// options.
std::vector<GoldenPicture> golden_pictures() {
  std::vector<GoldenPicture> pictures;
  std::ifstream file(std::string(LOCUS_SOURCE_DIR) + "/tests/golden/renders.txt");
  for (std::string line; std::getline(file, line);) {
    std::vector<std::string> words = absl::StrSplit(line, ' ');
    if (words.size() < 4)
      ADD_FAILURE() << "a line of renders.txt lacks words: " << line;
    else
      pictures.push_back({words[0], {words[1], words[2]}, words[3], {words.begin() + 4, words.end()}});
  }
  EXPECT_GE(pictures.size(), 9u);
  return pictures;
}

std::string picture_path(const std::string& name, uint32_t threads) {
  const std::string folder = std::string(LOCUS_BINARY_DIR) + "/golden";
  std::filesystem::create_directories(folder);
  return absl::StrCat(folder, "/", name, "-", threads, "-threads.png");
}

std::optional<Hashes> take(RenderServer& server, const GoldenPicture& picture, const std::string& path) {
  std::vector<std::string> line = {"-o", "json", "render", picture.scene, path, "--size", "160x120"};
  line.insert(line.end(), picture.options.begin(), picture.options.end());
  const Outcome outcome = server.run(line);
  if (outcome.code != ExitCode::kOk) {
    ADD_FAILURE() << outcome.err;
    return std::nullopt;
  }
  const Json report = Json::parse(outcome.out);
  EXPECT_GT(report["hits"], 100) << "the picture is nearly empty: " << path;
  return Hashes{report["depth_sha256"], report["ids_sha256"]};
}

class GoldenRenderTest : public ::testing::TestWithParam<uint32_t> {};

TEST_P(GoldenRenderTest, PicturesMatchTheirGoldenHashes) {
  RenderServer server(GetParam());
  for (const char* scene : {"city", "tilted", "far", "objects"}) make_scene(server, scene);
  for (const GoldenPicture& picture : golden_pictures()) {
    const std::string path = picture_path(picture.name, GetParam());
    const std::optional<Hashes> taken = take(server, picture, path);
    if (!taken) continue;
    if (*taken == picture.hashes) {
      std::filesystem::remove(path);
      continue;
    }
    ADD_FAILURE() << "the picture differs from its golden hashes; look at " << path << "\n  taken: " << picture.name
                  << " " << taken->depth << " " << taken->ids;
  }
}

INSTANTIATE_TEST_SUITE_P(Threads, GoldenRenderTest, ::testing::Values(1u, 2u),
                         [](const auto& threads) { return std::to_string(threads.param); });

TEST(GoldenRenderSensitivityTest, MovingOneObjectByATenThousandthChangesTheDepthHash) {
  const GoldenPicture picture = {
      "city-moved", {}, "city", {"--eye", "-20,-70,12", "--look-at", "10,0,6", "--fov", "60"}};
  const std::string path = picture_path(picture.name, 2);
  RenderServer server;
  make_scene(server, "city");
  const std::optional<Hashes> before = take(server, picture, path);
  const std::optional<Hashes> again = take(server, picture, path);
  const Outcome found = server.run({"-o", "json", "get", "city", "--id", "1000"});
  const Json position = Json::parse(found.out)["things"][0]["position"];
  client::UpdateBuilder move;
  const double x = position[0], y = position[1], z = position[2];
  move.move(1000, client::Double3{x + 1e-4, y, z});
  server.apply("city", move);
  const std::optional<Hashes> after = take(server, picture, path);
  ASSERT_TRUE(before && again && after);
  EXPECT_EQ(*before, *again);
  EXPECT_NE(before->depth, after->depth);
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace locus::cli
