// Quotas of one identity or connection: how much it may use at a time or in a second. Plain data; any thread.
#ifndef LOCUS_SERVER_SECURITY_QUOTA_H_
#define LOCUS_SERVER_SECURITY_QUOTA_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "absl/strings/string_view.h"

namespace locus::server {

// Quantity that a quota limits. The first three are rates, in units a second; the others are amounts in use at a time.
enum class QuotaKind : uint8_t {
  kQueries,        // queries of batches
  kWork,           // nodes and cells visited and primitives tested by queries; objects visited by dumps and other calls
  kUpdateItems,    // items of update batches
  kBytesInFlight,  // memory claimed by calls in progress: parsed requests, their work, replies not yet taken
  kOpenStreams,
  kObjects,    // objects in the scenes that the identity created
  kScenes,     // scenes that the identity created
  kMeshBytes,  // memory of the meshes that the identity uploaded; content with two names counts twice
  // Sum of history_bytes over the scenes that the identity created. history_bytes is the maximum memory of a scene's
  // history.
  kHistoryBytes,
};
inline constexpr size_t kQuotaKinds = 9;
inline constexpr std::array<absl::string_view, kQuotaKinds> kQuotaNames = {
    "queries_per_s", "work_per_s", "update_items_per_s", "bytes_in_flight", "open_streams",
    "objects",       "scenes",     "mesh_bytes",         "history_bytes"};

constexpr absl::string_view quota_name(QuotaKind kind) { return kQuotaNames[static_cast<size_t>(kind)]; }
constexpr bool is_rate(QuotaKind kind) { return kind <= QuotaKind::kUpdateItems; }
// Returns whether a connection can have a quota of the kind. The other kinds count objects, scenes, meshes and
// histories, which outlive connections.
constexpr bool is_of_connections(QuotaKind kind) { return kind <= QuotaKind::kOpenStreams; }
// Returns the kind of a name such as "open_streams"; nullopt if no kind has this name.
std::optional<QuotaKind> quota_named(absl::string_view name);

inline constexpr double kNoQuota = std::numeric_limits<double>::infinity();
inline constexpr double kDefaultBurstSeconds = 2;

struct Quota {
  std::array<double, kQuotaKinds> limits = {kNoQuota, kNoQuota, kNoQuota, kNoQuota, kNoQuota,
                                            kNoQuota, kNoQuota, kNoQuota, kNoQuota};
  double burst_s = kDefaultBurstSeconds;  // seconds for which an unused rate is saved up, to be used in one burst

  double of(QuotaKind kind) const { return limits[static_cast<size_t>(kind)]; }
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_QUOTA_H_
