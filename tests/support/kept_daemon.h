// A real locusd with a data directory, and stubs to call it. A test can stop or kill the process and start it again.
#ifndef LOCUS_TESTS_SUPPORT_KEPT_DAEMON_H_
#define LOCUS_TESTS_SUPPORT_KEPT_DAEMON_H_

#include <gtest/gtest.h>
#include <signal.h>

#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/daemon_process.h"
#include "tests/support/running_server.h"

namespace locus::test {

class KeptDaemon {
 public:
  // Starts no process yet. `options` are passed to locusd in addition to the address and the data directory.
  explicit KeptDaemon(std::vector<std::string> options = {}) : options_(std::move(options)) {}
  ~KeptDaemon() {
    process_.reset();
    std::filesystem::remove_all(directory());
  }

  // Replaces the options that were passed to the constructor; takes effect at the next start.
  void set_options(std::vector<std::string> options) { options_ = std::move(options); }

  std::string directory() const { return folder_.file("data"); }
  std::string log() const { return text_of(folder_.file("log")); }

  // Starts the daemon and waits until it serves.
  void start() {
    launch();
    port_ = DaemonProcess::wait_for_port(folder_.file("port"));
    stubs_ = std::make_unique<Stubs>("127.0.0.1:" + std::to_string(port_));
  }
  // Starts a daemon that is expected to exit before it serves, and returns its exit code.
  int exit_code_of_start() {
    launch();
    return process_->wait();
  }
  // Stops the daemon and returns its exit code.
  int stop() {
    process_->signal(SIGTERM);
    return process_->wait();
  }
  void kill() {
    process_->signal(SIGKILL);
    process_->wait();
  }
  Stubs& stubs() { return *stubs_; }
  int port() const { return port_; }  // port of the latest start

  // Runs `locusd` with the task `check` or `repair` and returns its exit code; printed() returns its output.
  int maintain(const std::string& task) const {
    DaemonProcess process({task, directory()}, folder_.file("second"));
    return process.wait();
  }
  std::string printed() const { return text_of(folder_.file("second")); }

 private:
  void launch() {
    std::remove(folder_.file("port").c_str());
    std::vector<std::string> all = {"--listen",    "127.0.0.1:0",        "--http-listen", "",
                                    "--port-file", folder_.file("port"), "--threads",     "2",
                                    "--data-dir",  directory()};
    all.insert(all.end(), options_.begin(), options_.end());
    process_ = std::make_unique<DaemonProcess>(all, folder_.file("log"));
  }

  TemporaryFolder folder_;
  std::vector<std::string> options_;
  std::unique_ptr<DaemonProcess> process_;
  int port_ = 0;
  std::unique_ptr<Stubs> stubs_;
};

inline v1::Scene create_scene(Stubs& stubs, const std::string& name, const v1::SceneSpec& spec = {}) {
  grpc::ClientContext context;
  set_timeout(context);
  v1::CreateSceneRequest request;
  request.set_name(name);
  *request.mutable_spec() = spec;
  v1::CreateSceneResponse response;
  const grpc::Status status = stubs.scenes->CreateScene(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.scene();
}

inline v1::Scene get_scene(Stubs& stubs, const std::string& name) {
  grpc::ClientContext context;
  set_timeout(context);
  v1::GetSceneRequest request;
  request.set_name(name);
  v1::GetSceneResponse response;
  const grpc::Status status = stubs.scenes->GetScene(&context, request, &response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response.scene();
}

// Returns the complete dump of a scene as text, for comparisons.
inline std::string dump_of(Stubs& stubs, const std::string& name) {
  grpc::ClientContext context;
  set_timeout(context);
  v1::DumpSceneRequest request;
  request.set_scene(name);
  const auto reader = stubs.scenes->DumpScene(&context, request);
  v1::DumpSceneResponse piece;
  std::string text;
  while (reader->Read(&piece)) text += piece.DebugString();
  const grpc::Status status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return text;
}

// Position of a point object in a scene.
struct PlacedPoint {
  double x, y, z;
  friend bool operator==(const PlacedPoint&, const PlacedPoint&) = default;
};
inline std::map<uint64_t, PlacedPoint> points_of(Stubs& stubs, const std::string& name) {
  grpc::ClientContext context;
  set_timeout(context);
  v1::DumpSceneRequest request;
  request.set_scene(name);
  const auto reader = stubs.scenes->DumpScene(&context, request);
  v1::DumpSceneResponse piece;
  std::map<uint64_t, PlacedPoint> points;
  while (reader->Read(&piece))
    for (const v1::Insert& insert : piece.objects())
      for (int i = 0; i < insert.ids_size(); ++i)
        points[insert.ids(i)] = {insert.positions_f64(3 * i), insert.positions_f64(3 * i + 1),
                                 insert.positions_f64(3 * i + 2)};
  const grpc::Status status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  return points;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_KEPT_DAEMON_H_
