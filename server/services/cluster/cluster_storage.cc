#include "server/services/cluster/cluster_storage.h"

#include <chrono>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/storage/postgres/engine_address.h"

namespace locus::server {

absl::StatusOr<ClusterStorage> open_cluster(const ServerConfig& config) {
  ClusterStorage storage;
  ASSIGN_OR_RETURN(const EngineAddress address, EngineAddress::parse(config.cluster));
  for (size_t host = 0; host < address.host_count(); ++host)
    absl::StrAppend(&storage.hosts, host == 0 ? "" : ",", address.host_name(host));
  storage.notices = std::make_unique<LogNotices>();
  storage.appends = std::make_unique<LatencyHistogram>();
  PostgresOptions options;
  options.url = config.cluster;
  options.replication =
      config.engine_replication == ReplicatedBy::kStorage ? EngineReplication::kStorage : EngineReplication::kStandbys;
  options.list_catalogue = false;
  LogNotices* const notices = storage.notices.get();
  options.on_fenced = [notices](SceneKey scene, uint64_t token) { notices->fenced(scene, token); };
  options.on_token = [notices](SceneKey scene, uint64_t before, uint64_t now) {
    notices->token_raised(scene, before, now);
  };
  options.on_append = [appends = storage.appends.get()](std::chrono::nanoseconds time) {
    appends->record(static_cast<uint64_t>(time.count()));
  };
  ASSIGN_OR_RETURN(storage.log, PostgresLog::open(options));
  ASSIGN_OR_RETURN(storage.engine, PostgresCluster::open(options));
  return storage;
}

}  // namespace locus::server
