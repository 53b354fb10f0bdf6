#include "server/service/server_service.h"

#include <algorithm>
#include <vector>

#include "core/base/limits.h"
#include "server/config/version.h"
#include "server/service/call.h"

namespace locus::server {
namespace {

struct NamedLimit {
  const char* name;
  double value;
  double used = 0;
};

// Every limit under the name that refusals use.
std::vector<NamedLimit> limits_of(const Host& host) {
  std::vector<NamedLimit> all = {
      {"blocks", limits::kMaxBlocks},
      {"calls", static_cast<double>(host.calls.max()), static_cast<double>(host.calls.used())},
      {"coordinate", limits::kMaxCoordinate},
      {"history_bytes", static_cast<double>(limits::kMaxHistoryBytes)},
      {"history_ticks", limits::kMaxHistoryTicks},
      {"ignored_ids", limits::kMaxIgnoredIds},
      {"instances", limits::kMaxInstances},
      {"label_length", limits::kMaxLabelLength},
      {"labels", limits::kMaxLabels},
      {"listed_item_errors", limits::kMaxListedItemErrors},
      {"reply_bytes", limits::kMaxReplyBytes},
      {"max_results", limits::kMaxMaxResults},
      {"memory_bytes", static_cast<double>(host.memory.limit()), static_cast<double>(host.memory.used())},
      {"mesh_parts", limits::kMaxMeshParts},
      {"mesh_triangles", limits::kMaxMeshTriangles},
      {"mesh_vertices", limits::kMaxMeshVertices},
      {"meshes", static_cast<double>(host.config.max_meshes), static_cast<double>(host.registry.mesh_count())},
      {"name_length", limits::kMaxNameLength},
      {"nearest", limits::kMaxNearest},
      {"objects", limits::kMaxObjects},
      {"page_size", limits::kMaxPageSize},
      {"pending_changes", limits::kMaxPendingChanges},
      {"pinned_bytes",
       static_cast<double>(host.config.pinned_limit != 0 ? host.config.pinned_limit : limits::kPinnedBytes)},
      {"queries", limits::kMaxQueries},
      {"receive_bytes", static_cast<double>(host.config.max_receive_bytes)},
      {"recent_revisions", limits::kRecentRevisions},
      {"scenes", static_cast<double>(host.config.max_scenes), static_cast<double>(host.registry.scene_count())},
      {"streams", static_cast<double>(host.streams.max()), static_cast<double>(host.streams.running())},
      {"threads", static_cast<double>(host.pool.threads())},
      {"update_items", limits::kMaxUpdateItems},
      {"update_lists", limits::kMaxUpdateLists},
      {"wait_ms", limits::kDefaultWaitMs},
      {"writers", limits::kMaxWriters},
  };
  std::sort(all.begin(), all.end(),
            [](const NamedLimit& a, const NamedLimit& b) { return absl::string_view(a.name) < b.name; });
  return all;
}

}  // namespace

grpc::Status ServerService::GetServer(grpc::ServerContext* context, const v1::GetServerRequest*,
                                      v1::GetServerResponse* response) {
  const auto body = [&](const Caller&) {
    response->set_version(kVersion);
    response->set_instruction_set("portable");
    for (const char* feature :
         {"as_of", "balls", "boxes", "download_mesh", "history", "lookup", "nearest", "rays", "static_from"})
      response->add_features(feature);
    for (const NamedLimit& limit : limits_of(host_)) {
      v1::Limit* out = response->add_limits();
      out->set_name(limit.name);
      out->set_value(limit.value);
      out->set_used(limit.used);
    }
    return absl::OkStatus();
  };
  return serve(host_, *context, "GetServer", body, WhileDraining::kServe);
}

}  // namespace locus::server
