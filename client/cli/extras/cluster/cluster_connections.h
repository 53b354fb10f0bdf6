// Connections to the members of a cluster, opened when they are first needed, with the credentials of the context. For
// commands that call the leaders of scenes. Not thread-safe.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_CLUSTER_CLUSTER_CONNECTIONS_H_
#define LOCUS_CLIENT_CLI_EXTRAS_CLUSTER_CLUSTER_CONNECTIONS_H_

#include <map>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "client/cli/context.h"
#include "client/cli/extras/cluster/cluster_facts.h"
#include "client/lib/client.h"

namespace locus::cli {

class ClusterConnections {
 public:
  // Maximum number of calls for one move: the leader can change between them, and the scene can have none for seconds.
  static constexpr int kMaxCalls = 40;

  // Borrows the context.
  explicit ClusterConnections(Context& context) : context_(context) {}

  // Returns the connection to a member. Returns UNAVAILABLE if it does not answer, and again on later calls without
  // waiting.
  absl::StatusOr<client::Client*> at(const std::string& address);

  // Moves a scene, beginning at the server of the context and following REASON_ELSEWHERE to the leader. Does nothing if
  // `to` leads it already. Returns FAILED_PRECONDITION for a scene of durability memory if `memory` is kStay.
  absl::StatusOr<v1::MoveSceneResponse> move(const std::string& scene, const std::string& to, MemoryScenes memory);
  // Moves a scene that the member `from` leads. Returns an error with REASON_ELSEWHERE if another one leads it.
  absl::StatusOr<v1::MoveSceneResponse> move_from(const std::string& from, const std::string& scene,
                                                  const std::string& to);

 private:
  Context& context_;
  std::map<std::string, absl::StatusOr<std::unique_ptr<client::Client>>> clients_;
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_CLUSTER_CLUSTER_CONNECTIONS_H_
