#include "tests/bench/serving/scan_cases.h"

#include <vector>

#include "server/rpc/wire_plan.h"
#include "tests/bench/serving/ray_batches.h"

namespace locus::bench::serving {
namespace {

constexpr const char* kScan = "scan/1024";
constexpr size_t kRaysAMessage = 1024;
constexpr double kMaxShare = 0.03;  // time of a scan, as a part of the time of a query

// Returns the messages in the form in which the server receives them.
std::vector<grpc::ByteBuffer> buffers_of(const Batches& batches) {
  std::vector<grpc::ByteBuffer> buffers;
  for (const v1::StreamQueriesRequest& message : batches.messages) {
    const grpc::Slice slice(message.SerializeAsString());
    buffers.emplace_back(&slice, 1);
  }
  return buffers;
}

}  // namespace

absl::Status run_scan_cases(const ServingRun& run) {
  if (!run.wants(kScan)) return absl::OkStatus();
  run.progress(kScan);
  const absl::StatusOr<BenchMesh> mesh = level_of(run);
  if (!mesh.ok()) return mesh.status();
  const auto daemon = Daemon::start();
  if (!daemon.ok()) return daemon.status();
  TwinScene scene(**daemon, "scan");
  absl::Status status = scene.create();
  status.Update(scene.place(*mesh));
  if (!status.ok()) return status;
  Batches batches = batches_of(coherent_rays(*mesh, run.options.quick ? 16'384 : 131'072), kRaysAMessage, scene.name());
  const std::vector<grpc::ByteBuffer> buffers = buffers_of(batches);
  const LocalLoad process(scene.here().latest(), batches, 1);
  const std::vector<uint64_t> hashes = process.hashes();
  const server::WirePlan& plan = server::wire_plan<v1::StreamQueriesRequest>();
  size_t refused = 0;
  const auto messages = static_cast<double>(buffers.size());
  const std::vector<Contestant> contestants = {{"scan",
                                                [&](size_t) {
                                                  for (const grpc::ByteBuffer& buffer : buffers)
                                                    refused += plan.scan(buffer).ok() ? 0 : 1;
                                                },
                                                messages,
                                                {}},
                                               {"whole_query", [&](size_t) { process.run(1); }, messages, {}}};
  const auto times = race(contestants, 1, run.options.rounds, wall_seconds);
  if (refused != 0) run.disagree(absl::StrCat(kScan, ": ", refused, " messages were refused"));
  add_cells(contestants, times, cell_of(kScan, "ns/message", hash_of_numbers(hashes)), run.report);
  note_bar(run.report, 1 / kMaxShare, absl::StrFormat(" = a scan takes at most %.0f %% of the query", 100 * kMaxShare));
  return absl::OkStatus();
}

}  // namespace locus::bench::serving
