#include "client/lib/gatherer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <vector>

namespace locus::client {
namespace {

using ::testing::ElementsAre;
using Numbers = std::vector<int>;

constexpr absl::Duration kLong = absl::Hours(1);

// Recorder of sent items: one list per message.
class Sent {
 public:
  auto taker() {
    return [this](Numbers numbers) {
      std::lock_guard lock(mutex_);
      messages_.push_back(std::move(numbers));
    };
  }
  std::vector<Numbers> messages() {
    std::lock_guard lock(mutex_);
    return messages_;
  }

 private:
  std::mutex mutex_;
  std::vector<Numbers> messages_;
};

void add(Gatherer<Numbers>& gatherer, int number) {
  gatherer.add([&](Numbers& numbers) { numbers.push_back(number); });
}

TEST(GathererTest, AFullBatchIsSentAtOnce) {
  std::promise<Numbers> first;
  Gatherer<Numbers> gatherer({.max_items = 3, .max_delay = kLong},
                             [&](Numbers numbers) { first.set_value(std::move(numbers)); });
  for (const int number : {1, 2, 3}) add(gatherer, number);
  EXPECT_THAT(first.get_future().get(), ElementsAre(1, 2, 3));
}

TEST(GathererTest, APartialBatchIsSentAfterTheDelay) {
  std::promise<Numbers> first;
  Gatherer<Numbers> gatherer({.max_items = 1000, .max_delay = absl::Milliseconds(1)},
                             [&](Numbers numbers) { first.set_value(std::move(numbers)); });
  add(gatherer, 7);
  EXPECT_THAT(first.get_future().get(), ElementsAre(7));
}

TEST(GathererTest, FlushSendsAPartialBatchAtOnce) {
  Sent sent;
  Gatherer<Numbers> gatherer({.max_items = 1000, .max_delay = kLong}, sent.taker());
  gatherer.flush();
  EXPECT_TRUE(sent.messages().empty());
  add(gatherer, 1);
  add(gatherer, 2);
  gatherer.flush();
  EXPECT_THAT(sent.messages(), ElementsAre(ElementsAre(1, 2)));
}

TEST(GathererTest, TheDestructorSendsAPartialBatch) {
  Sent sent;
  {
    Gatherer<Numbers> gatherer({.max_items = 1000, .max_delay = kLong}, sent.taker());
    add(gatherer, 9);
  }
  EXPECT_THAT(sent.messages(), ElementsAre(ElementsAre(9)));
}

TEST(GathererTest, WhileSendBlocksAtMostOneBatchIsGathered) {
  std::promise<void> may_go;
  std::shared_future<void> gate = may_go.get_future().share();
  Sent sent;
  const auto take = sent.taker();
  Gatherer<Numbers> gatherer({.max_items = 2, .max_delay = kLong}, [&](Numbers numbers) {
    gate.wait();
    take(std::move(numbers));
  });
  for (const int number : {1, 2, 3, 4}) add(gatherer, number);
  std::atomic<bool> added = false;
  std::thread more([&] {
    add(gatherer, 5);
    added = true;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_FALSE(added);
  may_go.set_value();
  more.join();
  gatherer.flush();
  EXPECT_THAT(sent.messages(), ElementsAre(ElementsAre(1, 2), ElementsAre(3, 4), ElementsAre(5)));
}

TEST(GathererTest, ItemsOfManyThreadsAllArriveAndItemsOfOneThreadInOrder) {
  Sent sent;
  {
    Gatherer<Numbers> gatherer({.max_items = 64, .max_delay = absl::Microseconds(100)}, sent.taker());
    std::vector<std::thread> threads;
    for (int thread = 0; thread < 4; ++thread)
      threads.emplace_back([&gatherer, thread] {
        for (int i = 0; i < 1000; ++i) add(gatherer, 1000 * thread + i);
      });
    for (std::thread& thread : threads) thread.join();
  }
  std::vector<int> next(4, 0);
  for (const Numbers& message : sent.messages()) {
    EXPECT_LE(message.size(), 64u);
    for (const int number : message) EXPECT_EQ(number % 1000, next[static_cast<size_t>(number / 1000)]++);
  }
  EXPECT_THAT(next, ElementsAre(1000, 1000, 1000, 1000));
}

}  // namespace
}  // namespace locus::client
