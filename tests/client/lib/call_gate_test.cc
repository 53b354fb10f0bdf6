#include "client/lib/call_gate.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>

namespace locus::client {
namespace {

TEST(CallGateTest, WithoutAGateEveryoneMayEnter) { EXPECT_TRUE(CallGate::enter(nullptr).ok()); }

TEST(CallGateTest, AClosedGateRefusesAndSaysWhy) {
  const auto gate = std::make_shared<CallGate>();
  EXPECT_TRUE(CallGate::enter(gate).ok());
  gate->close();
  const absl::Status refused = CallGate::enter(gate).status();
  EXPECT_TRUE(absl::IsUnavailable(refused));
  EXPECT_EQ(refused.message(), "the server of this process has ended");
  gate->wait_until_empty();
}

TEST(CallGateTest, TheWaitEndsWithTheLastPermit) {
  const auto gate = std::make_shared<CallGate>();
  absl::StatusOr<CallGate::Permit> one = CallGate::enter(gate), other = CallGate::enter(gate);
  ASSERT_TRUE(one.ok() && other.ok());
  gate->close();
  std::atomic<bool> is_last_gone{false};
  std::thread holder([&] {
    one->reset();
    is_last_gone = true;
    other->reset();
  });
  gate->wait_until_empty();
  EXPECT_TRUE(is_last_gone);
  holder.join();
}

TEST(CallGateTest, APermitKeepsItsGateAlive) {
  auto gate = std::make_shared<CallGate>();
  const std::weak_ptr<CallGate> seen = gate;
  absl::StatusOr<CallGate::Permit> permit = CallGate::enter(gate);
  gate.reset();
  EXPECT_FALSE(seen.expired());
  permit->reset();
  EXPECT_TRUE(seen.expired());
}

}  // namespace
}  // namespace locus::client
