#include "server/cluster/silence.h"

#include <gmock/gmock.h>

#include <vector>

namespace locus::server {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr MemberId kPeer = 7;

class SilenceCounterTest : public ::testing::Test {
 protected:
  static ClusterTime at(int64_t ms) { return ClusterTime(seconds(1000) + milliseconds(ms)); }
  // Own beats succeed each second from `from` to `to` and show `beat` of the peer.
  void see(int64_t from, int64_t to, uint64_t beat) {
    for (int64_t ms = from; ms <= to; ms += 1000) silence_.beat_succeeded(at(ms), std::vector<SeenBeat>{{kPeer, beat}});
  }
  bool silent_at(int64_t ms) const { return silence_.silent(at(ms)).has_value(); }

  SilenceCounter silence_{ClusterTiming()};
};

TEST_F(SilenceCounterTest, AMemberWithTheSameBeatForSixSecondsIsSilent) {
  see(0, 6000, 5);
  EXPECT_FALSE(silent_at(5999));
  ASSERT_TRUE(silent_at(6000));
  EXPECT_EQ(silence_.silent(at(6000))->id, kPeer);
  EXPECT_EQ(silence_.silent(at(6000))->beat, 5u);
  EXPECT_EQ(silence_.next(at(6000)), at(6000));
}

TEST_F(SilenceCounterTest, AMemberThatBeatsIsNeverSilent) {
  for (uint64_t beat = 0; beat < 20; ++beat) {
    see(static_cast<int64_t>(1000 * beat), static_cast<int64_t>(1000 * beat), beat);
    EXPECT_FALSE(silent_at(static_cast<int64_t>(1000 * beat + 999)));
  }
}

TEST_F(SilenceCounterTest, SilenceIsCountedAnewAfterAnOwnBeatFailed) {
  see(0, 5000, 5);
  silence_.beat_failed();
  see(6000, 11000, 5);
  EXPECT_FALSE(silent_at(11999));
  see(12000, 12000, 5);
  EXPECT_TRUE(silent_at(12000));
}

TEST_F(SilenceCounterTest, SilenceIsCountedAnewAfterAPauseOfTheOwnProcess) {
  see(0, 3000, 5);
  see(23000, 28000, 5);
  EXPECT_FALSE(silent_at(28900));
}

TEST_F(SilenceCounterTest, NobodyIsSilentWhileTheLastOwnBeatIsLongAgo) {
  see(0, 5000, 5);
  EXPECT_TRUE(silent_at(7500));
  EXPECT_FALSE(silent_at(7501));
}

// The caller would ask again and again while a beat hangs.
TEST_F(SilenceCounterTest, OnlyAFurtherBeatCanMakeAMemberSilentWhileTheLastOneIsLongAgo) {
  see(0, 6000, 5);
  EXPECT_EQ(silence_.next(at(8500)), at(6000));
  EXPECT_EQ(silence_.next(at(8501)), ClusterTime::max());
}

TEST_F(SilenceCounterTest, AMemberThatTurnedOutToBeLivingIsCountedAnew) {
  see(0, 6000, 5);
  silence_.restart(kPeer, at(6000));
  EXPECT_FALSE(silent_at(6000));
  see(7000, 12000, 5);
  EXPECT_TRUE(silent_at(12000));
}

TEST_F(SilenceCounterTest, AMemberThatIsNotWatchedAnyMoreIsForgotten) {
  see(0, 6000, 5);
  silence_.beat_succeeded(at(6500), {});
  EXPECT_FALSE(silent_at(6500));
  EXPECT_EQ(silence_.next(at(6500)), ClusterTime::max());
}

TEST_F(SilenceCounterTest, QuietMembersAreCounted) {
  see(0, 3000, 5);
  EXPECT_EQ(silence_.quiet(at(2499)), 0u);
  EXPECT_EQ(silence_.quiet(at(2500)), 1u);
}

}  // namespace
}  // namespace locus::server
