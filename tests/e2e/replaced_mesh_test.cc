// Tests that a daemon gives the memory of deleted meshes back to the system.
#include <chrono>
#include <functional>
#include <thread>

#include "core/base/sanitized_build.h"
#include "tests/support/daemon_process.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;

class ReplacedMeshTest : public ::testing::Test {
 protected:
  static constexpr uint32_t kSide = 364;  // a sheet of kSide x kSide squares: 265,000 triangles, about 19 MB

  // Uploads a sheet whose heights depend on `number`, and makes it the only instance of the scene in place of the sheet
  // before it, which is deleted.
  void replace(uint32_t number) {
    CubeMesh sheet;
    sheet.vertices.clear();
    sheet.indices.clear();
    for (uint32_t y = 0; y <= kSide; ++y)
      for (uint32_t x = 0; x <= kSide; ++x)
        for (const uint32_t value : {x, y, (x * 7 + y * 13 + number) % 29})
          sheet.vertices.push_back(static_cast<float>(value));
    for (uint32_t y = 0; y < kSide; ++y)
      for (uint32_t x = 0; x < kSide; ++x) {
        const uint32_t a = y * (kSide + 1) + x, b = a + kSide + 1;
        for (const uint32_t index : {a, a + 1, b, b, a + 1, b + 1}) sheet.indices.push_back(index);
      }
    grpc::ClientContext context;
    set_timeout(context);
    v1::UploadMeshResponse uploaded;
    const auto writer = stubs_.scenes->UploadMesh(&context, &uploaded);
    writer->Write(whole_mesh(name(number), sheet));
    writer->WritesDone();
    ASSERT_TRUE(writer->Finish().ok());
    v1::ChangeInstancesRequest change = place_one(name(number), number);
    if (number > 1) change.add_remove_ids(number - 1);
    v1::ChangeInstancesResponse changed;
    ASSERT_TRUE(call(*stubs_.scenes, &v1::SceneService::Stub::ChangeInstances, change, &changed).ok());
    if (number > 1) delete_mesh(number - 1);
  }
  void delete_mesh(uint32_t number) {
    v1::DeleteMeshRequest request;
    request.set_mesh(name(number));
    v1::DeleteMeshResponse response;
    ASSERT_TRUE(call(*stubs_.scenes, &v1::SceneService::Stub::DeleteMesh, request, &response).ok());
  }
  static std::string name(uint32_t number) { return "sheet" + std::to_string(number); }

  template <class Stub, class Request, class Response>
  static grpc::Status call(Stub& stub, grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                           const Request& request, Response* response) {
    grpc::ClientContext context;
    set_timeout(context);
    return (stub.*method)(&context, request, response);
  }

  uint64_t resident() const {
    const std::string status = text_of("/proc/" + std::to_string(daemon_.pid()) + "/status");
    const size_t at = status.find("VmRSS:");
    return at == std::string::npos ? 0 : std::strtoull(status.c_str() + at + 6, nullptr, 10) * 1024;
  }
  // Waits until the resident memory has not changed for three seconds, and returns it.
  uint64_t settled() const {
    uint64_t last = resident();
    for (auto since = steady_clock::now(); steady_clock::now() - since < seconds(3);) {
      std::this_thread::sleep_for(milliseconds(100));
      if (const uint64_t now = resident(); now != last) last = now, since = steady_clock::now();
    }
    return last;
  }
  // Waits up to a minute for the resident memory to be at most `bytes`, and returns the resident memory.
  uint64_t resident_at_most(uint64_t bytes) const {
    for (const auto until = steady_clock::now() + seconds(60); resident() > bytes && steady_clock::now() < until;)
      std::this_thread::sleep_for(milliseconds(50));
    return resident();
  }

  TemporaryFolder folder_;
  DaemonProcess daemon_{{"--listen", "127.0.0.1:0", "--port-file", folder_.file("port"), "--threads", "2"},
                        folder_.file("log")};
  Stubs stubs_{"127.0.0.1:" + std::to_string(DaemonProcess::wait_for_port(folder_.file("port")))};
};

TEST_F(ReplacedMeshTest, TheMemoryOfReplacedAndDeletedMeshesIsGivenBack) {
  if (kSanitizedBuild) GTEST_SKIP() << "the sanitizer's allocator keeps freed memory";
  v1::CreateSceneRequest scene;
  scene.set_name("world");
  v1::CreateSceneResponse created;
  ASSERT_TRUE(call(*stubs_.scenes, &v1::SceneService::Stub::CreateScene, scene, &created).ok());
  ASSERT_NO_FATAL_FAILURE(replace(1));
  const uint64_t one = settled();
  constexpr uint32_t kLast = 30;
  for (uint32_t number = 2; number <= kLast; ++number) ASSERT_NO_FATAL_FAILURE(replace(number));
  EXPECT_LE(resident_at_most(one + one / 10 * 3), one + one / 10 * 3);
  v1::DeleteSceneRequest removal;
  removal.set_name("world");
  v1::DeleteSceneResponse removed;
  ASSERT_TRUE(call(*stubs_.scenes, &v1::SceneService::Stub::DeleteScene, removal, &removed).ok());
  ASSERT_NO_FATAL_FAILURE(delete_mesh(kLast));
  EXPECT_LE(resident_at_most(one), one) << "no more than with one mesh";
}

}  // namespace
}  // namespace locus::test
