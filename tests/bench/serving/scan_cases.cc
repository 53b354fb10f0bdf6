#include "tests/bench/serving/scan_cases.h"

#include <vector>

#include "core/base/status_macros.h"
#include "server/rpc/wire_plan.h"
#include "tests/bench/serving/ray_batches.h"
#include "tests/bench/serving/served_level.h"

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
  ASSIGN_OR_RETURN(const ServedLevel level, ServedLevel::start(run, "scan"));
  Batches batches =
      batches_of(coherent_rays(level.mesh, run.options.quick ? 16'384 : 131'072), kRaysAMessage, level.scene->name());
  const std::vector<grpc::ByteBuffer> buffers = buffers_of(batches);
  const LocalLoad process(level.scene->here().latest(), batches, 1);
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
