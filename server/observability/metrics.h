// What the daemon counts about its calls while it works, for /metrics. This is the interface for whoever serves calls:
//
// - every unary call, when its answer is known, and every message of a stream, when its answer is written:
//   record_call(rpc, code, nanoseconds since it arrived); serve() does it for all calls that go through it;
// - every block of queries that was answered: record_block();
// - every batch of updates that was published: record_update();
// - every refused call or message: record_refusal();
// - every stream: an OpenStream for as long as it is open.
//
// Threads: everything may be called from any thread. Recording takes no lock and allocates nothing, record_refusal()
// apart; counters are split over stripes, so that threads seldom share a cache line. read() sums the stripes up while
// others go on counting: each number is right, two of them may be of slightly different moments.
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
#include "core/base/mutex.h"
#include "core/index/work.h"
#include "server/observability/latency_histogram.h"

namespace locus::server {

enum class Rpc : uint8_t {
  kGetServer,
  kBackup,
  kCreateScene,
  kGetScene,
  kListScenes,
  kDeleteScene,
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
};
inline constexpr size_t kRpcs = 16;
// As the protocol calls it: "StreamQueries".
absl::string_view rpc_name(Rpc rpc);

// In the order of QueryBlock::kind: static_cast<QueryKind>(block.kind.index()).
enum class QueryKind : uint8_t { kRay, kBall, kBox, kLookup, kNearest };
inline constexpr size_t kQueryKinds = 5;
// "ray", "ball", ...
absl::string_view query_kind_name(QueryKind kind);

inline constexpr size_t kStatusCodes = 17;  // OK to UNAUTHENTICATED

struct RpcCounts {
  std::array<uint64_t, kStatusCodes> codes{};
  LatencyCounts latency;
  uint64_t open = 0;  // streams
};

struct QueryCounts {
  uint64_t queries = 0;
  Work work;
  LatencyCounts latency;  // of blocks
};

// A refusal's reason and the limit it names; either may be empty.
using RefusalName = std::pair<std::string, std::string>;

struct MetricCounts {
  std::array<RpcCounts, kRpcs> rpcs;
  std::array<QueryCounts, kQueryKinds> queries;
  uint64_t update_items = 0;
  LatencyCounts update_lag;
  LatencyCounts mesh_builds;
  LatencyCounts instance_changes;
  std::map<RefusalName, uint64_t> refusals;
};

class CallMetrics {
 public:
  // From the arrival of a call or message to its answer.
  void record_call(Rpc rpc, absl::StatusCode code, uint64_t nanoseconds);
  // `nanoseconds` of processor time, all threads together.
  void record_block(QueryKind kind, uint64_t queries, uint64_t nanoseconds, const Work& work);
  // From the arrival of a batch to the publication of its revision.
  void record_update(uint64_t items, uint64_t nanoseconds);
  // Of a mesh's tree.
  void record_mesh_build(uint64_t nanoseconds);
  // From the request to the publication of its revision.
  void record_instance_change(uint64_t nanoseconds);
  // Of a status that is not OK: under the reason that it carries, or else under the name of its code. At most
  // kMaxRefusalNames names are kept apart, the rest are counted as "_other". Takes a lock for a moment.
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
    std::array<QueryStripe, kQueryKinds> queries;
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

// Counts a stream as open for as long as it lives. Must not outlive the metrics.
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
