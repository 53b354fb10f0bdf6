#include "server/security/rights.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace locus::server {
namespace {

TEST(RightsTest, EveryRowIsFoundByItsPathAndNoneTwice) {
  std::set<std::string> paths;
  for (const RpcRight& row : kRpcRights) {
    EXPECT_EQ(right_of(row.path), &row);
    EXPECT_TRUE(paths.insert(std::string(row.path)).second) << row.path;
  }
}

TEST(RightsTest, PathsThatAreNotListedHaveNoRow) {
  for (const char* const path : {"", "/", "Query", "/locus.v1.QueryService/", "/locus.v1.QueryService/Query/",
                                 "/locus.v1.QueryService/query", "locus.v1.QueryService/Query", "/locus.v1.Query"})
    EXPECT_EQ(right_of(path), nullptr) << path;
}

TEST(RightsTest, RightsToScenesNameTheSceneAndOthersDoNot) {
  for (const RpcRight& row : kRpcRights) {
    EXPECT_EQ(row.need == Need::kSceneRight, row.scene != SceneField::kNone) << row.path;
    if (row.need == Need::kSceneRight || row.need == Need::kListed) {
      EXPECT_TRUE(is_scene_right(row.right)) << row.path;
    }
    if (row.need == Need::kServerRight) {
      EXPECT_FALSE(is_scene_right(row.right)) << row.path;
    }
  }
}

TEST(RightsTest, OnlyHealthIsForEverybody) {
  for (const RpcRight& row : kRpcRights)
    EXPECT_EQ(row.need == Need::kNothing, row.path.find("grpc.health") != absl::string_view::npos) << row.path;
}

TEST(RightsTest, ChangesNeedMoreThanReading) {
  for (const char* const path : {"/locus.v1.UpdateService/ApplyUpdates", "/locus.v1.UpdateService/StreamUpdates",
                                 "/locus.v1.SceneService/ChangeInstances"})
    EXPECT_EQ(right_of(path)->right, Right::kUpdate) << path;
  for (const char* const path : {"/locus.v1.SceneService/CreateScene", "/locus.v1.SceneService/UpdateScene",
                                 "/locus.v1.SceneService/DeleteScene"})
    EXPECT_EQ(right_of(path)->right, Right::kAdmin) << path;
  EXPECT_TRUE(right_of("/locus.v1.SceneService/CreateScene")->reads_static_from);
}

TEST(RightsTest, NamesAreReadBack) {
  for (size_t i = 0; i < kRights; ++i) {
    const auto right = static_cast<Right>(i);
    EXPECT_EQ(right_named(right_name(right)), right);
  }
  EXPECT_FALSE(right_named("").has_value());
  EXPECT_FALSE(right_named("Read").has_value());
}

}  // namespace
}  // namespace locus::server
