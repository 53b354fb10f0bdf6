#include "client/cli/extras/cluster/cluster_connections.h"

#include <algorithm>
#include <functional>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/lib/status.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr absl::Duration kMinWait = absl::Milliseconds(50);

v1::Reason reason_of(const absl::Status& status) {
  const std::optional<v1::Error> error = client::error_of(status);
  return error ? error->reason() : v1::REASON_UNSPECIFIED;
}

// Moves a scene unless `request.to` leads it already, or its new leader would not have its objects.
absl::StatusOr<v1::MoveSceneResponse> check_and_move(const client::Client& client, const v1::MoveSceneRequest& request,
                                                     MemoryScenes memory) {
  ASSIGN_OR_RETURN(const v1::Scene scene, client.get_scene(request.scene()));
  if (!request.to().empty() && scene.placement().leader() == request.to()) {
    v1::MoveSceneResponse unmoved;
    unmoved.set_leader(request.to());
    unmoved.set_token(scene.placement().token());
    return unmoved;
  }
  if (scene.spec().durability() == v1::DURABILITY_MEMORY && memory == MemoryScenes::kStay)
    return absl::FailedPreconditionError(
        absl::StrCat(scene.name(), " is in the memory of its leader only: --with-memory moves it without its objects"));
  return client.move_scene(request);
}

// Calls `once` again while the scene has no leader or its leader still reads it. `calls` counts all calls.
absl::StatusOr<v1::MoveSceneResponse> call_with_leader(
    const std::function<absl::StatusOr<v1::MoveSceneResponse>()>& once, int& calls) {
  while (true) {
    absl::StatusOr<v1::MoveSceneResponse> moved = once();
    if (++calls >= ClusterConnections::kMaxCalls || reason_of(moved.status()) != v1::REASON_NO_LEADER) return moved;
    absl::SleepFor(std::max(kMinWait, client::retry_after(moved.status())));
  }
}

v1::MoveSceneRequest request_of(const std::string& scene, const std::string& to) {
  v1::MoveSceneRequest request;
  request.set_scene(scene);
  request.set_to(to);
  return request;
}

}  // namespace

absl::StatusOr<client::Client*> ClusterConnections::at(const std::string& address) {
  auto found = clients_.find(address);
  if (found == clients_.end()) found = clients_.emplace(address, context_.open_connection(address)).first;
  RETURN_IF_ERROR(found->second.status());
  return found->second->get();
}

absl::StatusOr<v1::MoveSceneResponse> ClusterConnections::move(const std::string& scene, const std::string& to,
                                                               MemoryScenes memory) {
  ASSIGN_OR_RETURN(client::Client * client, context_.connect());
  const v1::MoveSceneRequest request = request_of(scene, to);
  int calls = 0;
  while (true) {
    absl::StatusOr<v1::MoveSceneResponse> moved =
        call_with_leader([&] { return check_and_move(*client, request, memory); }, calls);
    if (calls >= kMaxCalls || reason_of(moved.status()) != v1::REASON_ELSEWHERE) return moved;
    const std::optional<v1::Error> error = client::error_of(moved.status());
    if (error->addresses().empty()) return moved;
    ASSIGN_OR_RETURN(client, at(error->addresses(0)));
  }
}

absl::StatusOr<v1::MoveSceneResponse> ClusterConnections::move_from(const std::string& from, const std::string& scene,
                                                                    const std::string& to) {
  ASSIGN_OR_RETURN(client::Client* const client, at(from));
  int calls = 0;
  return call_with_leader([&] { return client->move_scene(request_of(scene, to)); }, calls);
}

}  // namespace locus::cli
