#include "server/rpc/io_threads.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>

namespace locus::test {
namespace {

using server::IoThreads;

// Tag that posts itself again until it has arrived `count` times.
class Repeated final : public server::EventTag {
 public:
  Repeated(server::IoLoop& loop, int count) : loop_(loop), left_(count) {}
  void arrived(bool) override {
    if (--left_ > 0) loop_.post(*this);
  }
  bool done() const { return left_ == 0; }

 private:
  server::IoLoop& loop_;
  int left_;
};

// A turn that finds a posted tag polls gRPC without waiting. If it waited for the rest of a millisecond, to which gRPC
// rounds deadlines, these turns would last for seconds, and the timer would come first.
TEST(IoThreadsTest, ATagThatIsPostedWhileTheLoopIsAwakeDoesNotWaitForGrpc) {
  grpc::ServerBuilder builder;
  IoThreads threads(builder, 1);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  ASSERT_NE(server, nullptr);
  server::IoLoop& loop = threads.loop(0);
  bool is_late = false;
  loop.at(std::chrono::steady_clock::now() + std::chrono::seconds(2), [&is_late] { is_late = true; });
  Repeated tag(loop, 10'000);
  loop.post(tag);
  while (!tag.done()) loop.turn();
  EXPECT_FALSE(is_late);
  server->Shutdown();
  threads.stop();
}

}  // namespace
}  // namespace locus::test
