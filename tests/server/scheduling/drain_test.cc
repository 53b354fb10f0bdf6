#include "server/scheduling/drain.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

namespace locus::server {
namespace {

TEST(DrainTest, ListenersAreCalledOnce) {
  Drain drain;
  int calls = 0;
  const Drain::Subscription subscription(drain, [&calls] { ++calls; });
  EXPECT_FALSE(drain.draining());
  drain.begin();
  drain.begin();
  EXPECT_TRUE(drain.draining());
  EXPECT_FALSE(drain.ended());
  EXPECT_EQ(calls, 1);
}

TEST(DrainTest, AListenerAddedWhileDrainingIsCalledAtOnce) {
  Drain drain;
  drain.begin();
  int calls = 0;
  const Drain::Subscription subscription(drain, [&calls] { ++calls; });
  EXPECT_EQ(calls, 1);
}

TEST(DrainTest, ADroppedSubscriptionIsNotCalled) {
  Drain drain;
  int calls = 0;
  {
    const Drain::Subscription subscription(drain, [&calls] { ++calls; });
  }
  drain.begin();
  EXPECT_EQ(calls, 0);
}

TEST(DrainTest, ConcurrentSubscriptionsAndBeginAreSafe) {
  Drain drain;
  std::atomic<int> told{0};
  std::thread subscriber([&] {
    while (told.load() == 0) {
      const Drain::Subscription subscription(drain, [&told] { ++told; });
    }
  });
  drain.begin();
  subscriber.join();
  EXPECT_EQ(told.load(), 1);
  drain.end();
  EXPECT_TRUE(drain.ended_flag()->load());
}

}  // namespace
}  // namespace locus::server
