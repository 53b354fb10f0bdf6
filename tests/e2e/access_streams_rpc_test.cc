// Streams of a server with access control that lose a right, and the audit of ends of leases.
#include <gmock/gmock.h>

#include <string>

#include "tests/support/access_fixture.h"

namespace locus::test {
namespace {

using ::testing::HasSubstr;
using AccessStreamsRpcTest = AccessRpcTest;

TEST_F(AccessStreamsRpcTest, EndsOfLeasesAreAuditedAsUpdatesOfTheServer) {
  v1::ApplyUpdatesRequest update;
  update.set_scene("arena-1");
  *update.mutable_batch() = insert_balls(1, 3);
  update.mutable_batch()->set_writer(7);
  update.mutable_batch()->set_batch(1);
  update.mutable_batch()->set_lease_ms(20);
  ASSERT_TRUE(raw_call(running_->stubs().channel, "/locus.v1.UpdateService/ApplyUpdates", update.SerializeAsString(),
                       kCallTimeout, tokens_["updater"])
                  .status.ok());
  v1::GetSceneResponse scene;
  while (scene.scene().revision() < 2)
    ASSERT_TRUE(scene.ParseFromString(call("/locus.v1.SceneService/GetScene", "admin").bytes));
  EXPECT_EQ(scene.scene().objects(), 0u);
  running_.reset();  // writes the queued lines
  const std::string line = read("audit");
  const size_t start = line.find(R"("principal":"locusd","peer":"","rpc":"end_lease","subject":"arena-1","code":"OK")");
  ASSERT_NE(start, std::string::npos) << line;
  EXPECT_THAT(line.substr(start, line.find('\n', start) - start), HasSubstr("1 batches changed 3 objects in "));
}

}  // namespace
}  // namespace locus::test
