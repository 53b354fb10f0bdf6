#include "server/cluster/scene_lease.h"

#include <gmock/gmock.h>

#include <memory>

namespace locus::server {
namespace {

using std::chrono::seconds;

class SceneLeaseTest : public ::testing::Test {
 protected:
  ClusterTime now_{seconds(1000)};
  std::shared_ptr<MemberLease> member_ = std::make_shared<MemberLease>([this] { return now_; });
  SceneLease scene_{5, 3, member_};
};

TEST_F(SceneLeaseTest, ALeaseLivesUntilTheEndOfItsExtension) {
  EXPECT_EQ(scene_.state(), SceneLease::State::kExpired);
  member_->extend(now_ + seconds(5));
  EXPECT_TRUE(scene_.living());
  now_ += seconds(5);
  EXPECT_EQ(scene_.state(), SceneLease::State::kExpired);
}

// Simulates SIGSTOP: the time passes and nothing runs.
TEST_F(SceneLeaseTest, APausedProcessFindsItsLeaseExpiredUntilABeatSucceeds) {
  member_->extend(now_ + seconds(5));
  now_ += seconds(20);
  EXPECT_FALSE(scene_.living());
  member_->extend(now_ + seconds(5));
  EXPECT_TRUE(scene_.living());
}

TEST_F(SceneLeaseTest, AnExtensionNeverShortensALease) {
  member_->extend(now_ + seconds(5));
  member_->extend(now_ + seconds(1));
  EXPECT_EQ(member_->expires(), now_ + seconds(5));
}

TEST_F(SceneLeaseTest, AnEndedOrStoppedLeaseNeverLivesAgain) {
  SceneLease other(6, 1, member_);
  member_->extend(now_ + seconds(5));
  scene_.stop();
  EXPECT_EQ(scene_.state(), SceneLease::State::kStopped);
  EXPECT_TRUE(other.living());
  member_->end();
  member_->extend(now_ + seconds(9));
  EXPECT_EQ(other.state(), SceneLease::State::kStopped);
  EXPECT_FALSE(member_->living());
}

}  // namespace
}  // namespace locus::server
