// Counters of the daemon's calls, for /metrics. Code that serves calls must record:
//
// - every message of a stream of queries or updates, and every other call, when its answer is known: record_call(rpc,
//   code, nanoseconds since the call or message arrived); BlockingCalls and HotCall record the calls that they serve;
// - every answered block of queries: record_block();
// - every published batch of updates: record_update();
// - every refused call or message: record_refusal();
// - every open stream: an OpenStream that lives as long as the stream.
//
// Threads: every member may be called from any thread. Recording takes no lock and allocates nothing, except in
// record_refusal(). Counters are split into stripes, so that threads rarely share a cache line. read() adds the stripes
// while other threads count: each number is correct, but two numbers may have been read at slightly different times.
#ifndef LOCUS_SERVER_OBSERVABILITY_METRICS_H_
#define LOCUS_SERVER_OBSERVABILITY_METRICS_H_

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/base/block_kind.h"
#include "core/base/mutex.h"
#include "core/index/work.h"
#include "server/observability/latency_histogram.h"

namespace locus::server {

enum class Rpc : uint8_t {
  kGetServer,
  kGetQuotas,
  kBackup,
  kMoveScene,
  kCreateScene,
  kGetScene,
  kListScenes,
  kDeleteScene,
  kUpdateScene,
  kUploadMesh,
  kListMeshes,
  kDeleteMesh,
  kDownloadMesh,
  kChangeInstances,
  kDumpScene,
  kApplyUpdates,
  kStreamUpdates,
  kQuery,
  kStreamQueries,
  kStep,
};
inline constexpr size_t kRpcs = 20;
// Returns the rpc's name in the protocol, such as "StreamQueries".
absl::string_view rpc_name(Rpc rpc);

inline constexpr size_t kStatusCodes = 17;  // OK to UNAUTHENTICATED

struct RpcCounts {
  std::array<uint64_t, kStatusCodes> codes{};
  LatencyCounts latency;
  uint64_t open = 0;  // number of open streams
};

struct QueryCounts {
  uint64_t queries = 0;
  Work work;
  LatencyCounts latency;  // processor time of each block
};

// Reason of a refusal, and name of the exceeded limit; the limit is empty if the refusal names no limit.
using RefusalName = std::pair<std::string, std::string>;

struct MetricCounts {
  std::array<RpcCounts, kRpcs> rpcs;
  std::array<QueryCounts, kBlockKinds> queries;
  uint64_t update_items = 0;
  LatencyCounts update_lag;
  LatencyCounts mesh_builds;
  LatencyCounts instance_changes;
  std::map<RefusalName, uint64_t> refusals;
};

class CallMetrics {
 public:
  // Records a call or message. `nanoseconds` is the time from its arrival to its answer.
  void record_call(Rpc rpc, absl::StatusCode code, uint64_t nanoseconds);
  // Records a block of queries. `nanoseconds` is the processor time of all threads together.
  void record_block(BlockKind kind, uint64_t queries, uint64_t nanoseconds, const Work& work);
  // Records a batch of updates. `nanoseconds` is the time from its arrival to the publication of its revision.
  void record_update(uint64_t items, uint64_t nanoseconds);
  // Records the time that building a mesh's tree took.
  void record_mesh_build(uint64_t nanoseconds);
  // Records a change of instances. `nanoseconds` is the time from the request to the publication of its revision.
  void record_instance_change(uint64_t nanoseconds);
  // Records a status that is not OK, under its reason, or under the name of its code if it has no reason. At most
  // kMaxRefusalNames names are counted separately, all further names together as "_other". Takes a lock briefly.
  void record_refusal(const absl::Status& status) LOCUS_EXCLUDES(mutex_);

  MetricCounts read() const LOCUS_EXCLUDES(mutex_);

 private:
  friend class OpenStream;
  using Counter = std::atomic<uint64_t>;

  struct QueryStripe {
    Counter queries{0};
    Counter nodes{0};
    Counter cells{0};
    Counter tests{0};
    LatencyHistogram latency;
  };
  struct alignas(64) Stripe {
    std::array<std::array<Counter, kStatusCodes>, kRpcs> codes{};
    std::array<LatencyHistogram, kRpcs> calls;
    std::array<QueryStripe, kBlockKinds> queries;
    Counter update_items{0};
    LatencyHistogram update_lag;
  };
  static constexpr size_t kStripes = 8;

  Stripe& stripe();
  void read(const Stripe& stripe, MetricCounts& counts) const;

  std::array<Stripe, kStripes> stripes_;
  std::array<Counter, kRpcs> open_streams_{};
  LatencyHistogram mesh_builds_;
  LatencyHistogram instance_changes_;
  mutable Mutex mutex_;
  std::map<RefusalName, uint64_t> refusals_ LOCUS_GUARDED_BY(mutex_);
};

// Scope during which a stream is counted as open. Must not outlive the metrics.
class OpenStream {
 public:
  OpenStream(CallMetrics& metrics, Rpc rpc) : open_(metrics.open_streams_[static_cast<size_t>(rpc)]) {
    open_.fetch_add(1, std::memory_order_relaxed);
  }
  ~OpenStream() { open_.fetch_sub(1, std::memory_order_relaxed); }
  OpenStream(const OpenStream&) = delete;
  OpenStream& operator=(const OpenStream&) = delete;

 private:
  std::atomic<uint64_t>& open_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_METRICS_H_
