#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "client/cli/output.h"
#include "tests/client/cli/extras/render/render_scene.h"

namespace locus::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Fixture with two balls on the ground of a city.
class RenderCommandTest : public ::testing::Test {
 protected:
  void SetUp() override {
    server_.create("arena");
    server_.create("empty");
    server_.place("arena", 1, server_.upload_city(12), {0, 0, 0}, {}, 4);
    client::UpdateBuilder updates;
    updates.insert_ball(7, client::Double3{0, 0, 3}, 2).insert_ball(8, client::Double3{9, 9, 3}, 2);
    updates.insert_ball(9, client::Double3{0, 0, 9}, 2, {.layers = 0});
    server_.apply("arena", updates);
  }
  void TearDown() override { std::filesystem::remove(path_); }

  Outcome render(std::vector<std::string> options, Progress progress = Progress::kSilent) {
    options.insert(options.begin(), {"-o", "json", "render", "arena", path_});
    if (std::find(options.begin(), options.end(), "--size") == options.end()) {
      options.insert(options.end(), {"--size", "32x24"});
    }
    return server_.run(options, progress);
  }
  Json report(const std::vector<std::string>& options) {
    const Outcome outcome = render(options);
    EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
    return Json::parse(outcome.out, nullptr, /*allow_exceptions=*/false);
  }
  void expect_refused(const std::vector<std::string>& options, ExitCode code, const std::string& words) {
    const Outcome outcome = render(options);
    EXPECT_EQ(outcome.code, code) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(words));
    EXPECT_THAT(outcome.out, IsEmpty());
    EXPECT_FALSE(std::filesystem::exists(path_));
  }

  const std::string path_ = ::testing::TempDir() + "/render_command_test.png";
  RenderServer server_;
};

TEST_F(RenderCommandTest, ThePictureIsWrittenAndReported) {
  const Json json = report({});
  EXPECT_TRUE(std::filesystem::exists(path_));
  EXPECT_EQ(json["file"], path_);
  EXPECT_EQ(json["width"], 32);
  EXPECT_EQ(json["height"], 24);
  EXPECT_EQ(json["rays"], 32 * 24);
  EXPECT_GT(json["hits"], 100);
  EXPECT_EQ(json["revision"], server_.revision("arena").revision);
  EXPECT_EQ(std::string(json["depth_sha256"]).size(), 64u);
  EXPECT_EQ(std::string(json["ids_sha256"]).size(), 64u);
  EXPECT_LT(json["nearest"], json["furthest"]);
}

TEST_F(RenderCommandTest, EveryChannelShowsTheSameHits) {
  const Json shaded = report({});
  for (const char* channel : {"depth", "normals", "ids", "shaded"}) {
    EXPECT_EQ(report({"--show", channel})["ids_sha256"], shaded["ids_sha256"]) << channel;
  }
  for (const char* cost : {"work", "nodes", "cells", "tests"}) {
    const Json heat = report({"--heat", cost});
    EXPECT_EQ(heat["depth_sha256"], shaded["depth_sha256"]) << cost;
    EXPECT_LE(heat["cheapest"], heat["median"]);
    EXPECT_LE(heat["median"], heat["brightest"]);
    EXPECT_LE(heat["brightest"], heat["dearest"]);
    EXPECT_GT(heat["dearest"], 0);
  }
}

TEST_F(RenderCommandTest, FourSamplesPerPixelCastFourTimesTheRays) {
  const Json json = report({"--samples", "4"});
  EXPECT_EQ(json["rays"], 4 * 32 * 24);
  EXPECT_EQ(json["width"], 32);
}

TEST_F(RenderCommandTest, APictureOfOneThingIsCloserThanThatOfTheScene) {
  EXPECT_LT(report({"--at", "7"})["nearest"], report({})["nearest"]);
}

TEST_F(RenderCommandTest, LivePicturesNameTheFirstAndTheLastRevision) {
  const Json json = report({"--live"});
  EXPECT_EQ(json["first_revision"], json["revision"]);
}

TEST_F(RenderCommandTest, ProgressIsWrittenOnlyIfLive) {
  EXPECT_THAT(render({}).err, IsEmpty());
  EXPECT_THAT(render({}, Progress::kLive).err, HasSubstr("rendering "));
}

TEST_F(RenderCommandTest, AnEmptySceneIsRefused) {
  const Outcome outcome = server_.run({"render", "empty", path_});
  EXPECT_EQ(outcome.code, ExitCode::kFailed);
  EXPECT_THAT(outcome.err, HasSubstr("scene empty is empty, there is nothing to see"));
}

TEST_F(RenderCommandTest, MissingScenesAndHiddenOrMissingThingsAreNotFound) {
  EXPECT_EQ(server_.run({"render", "nowhere", path_}).code, ExitCode::kNotFound);
  expect_refused({"--at", "99"}, ExitCode::kNotFound, "scene arena has no object or instance 99");
  expect_refused({"--at", "9"}, ExitCode::kNotFound, "it is hidden (layers 0)");
}

TEST_F(RenderCommandTest, AnImpossibleOutputPathIsRefusedBeforeAnyRequest) {
  const Outcome folder = server_.run({"render", "nowhere", "/nonexistent/x.png"});
  EXPECT_EQ(folder.code, ExitCode::kFailed);
  EXPECT_THAT(folder.err, HasSubstr("there is no folder /nonexistent"));
  EXPECT_THAT(server_.run({"render", "arena", "x.bmp"}).err, HasSubstr("does not end in .png"));
}

TEST_F(RenderCommandTest, MistakesInTheLineAreUsageErrors) {
  expect_refused({"--eye", "1,1,1", "--look-at", "1,1,1"}, ExitCode::kUsage, "are the same point");
  expect_refused({"--dir", "0,0,-1", "--up", "0,0,1"}, ExitCode::kUsage, "up is parallel to the view");
  expect_refused({"--look-at", "1,1,1"}, ExitCode::kUsage, "--look-at needs --eye");
  expect_refused({"--size", "4097x4096"}, ExitCode::kUsage, "(16777216)");
  expect_refused({"--size", "4294967295x4294967295"}, ExitCode::kUsage, "(16777216)");
  expect_refused({"--size", "4096x4096", "--samples", "4"}, ExitCode::kUsage, "--samples 4");
  expect_refused({"--size", "40"}, ExitCode::kUsage, "--size");
  expect_refused({"--fov", "171"}, ExitCode::kUsage, "--fov");
  expect_refused({"--ortho", "-1"}, ExitCode::kUsage, "--ortho");
  expect_refused({"--show", "ids", "--heat", "work"}, ExitCode::kUsage, "--heat");
  expect_refused({"--samples", "2"}, ExitCode::kUsage, "--samples");
}

}  // namespace
}  // namespace locus::cli
