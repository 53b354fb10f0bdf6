// Choice of the server for each call of a client: the only server, or the server of a cluster that leads or follows the
// scene of the call. Internal to the library. Thread-safe.
#ifndef LOCUS_CLIENT_LIB_ROUTER_H_
#define LOCUS_CLIENT_LIB_ROUTER_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "client/lib/authorization.h"
#include "client/lib/connection.h"
#include "client/lib/options.h"
#include "client/lib/routes.h"
#include "client/lib/running_calls.h"
#include "client/lib/values.h"
#include "locus/v1/query_service.grpc.pb.h"
#include "locus/v1/scene_service.grpc.pb.h"
#include "locus/v1/server_service.grpc.pb.h"
#include "locus/v1/update_service.grpc.pb.h"

namespace locus::client {

// Connections to one server.
struct ServerLinks {
  ServerLinks(std::string with_target, std::shared_ptr<Authorization> with_authorization, Link with_latency,
              Link with_bulk);

  const Link& link_of(Lane lane) const { return lane == Lane::kBulk ? bulk : latency; }

  std::string target;
  std::shared_ptr<Authorization> authorization;
  Link latency;  // for Lane::kLatency and unary calls
  Link bulk;
  std::unique_ptr<v1::ServerService::StubInterface> servers;
  std::unique_ptr<v1::SceneService::StubInterface> scenes;
  std::unique_ptr<v1::UpdateService::StubInterface> updates;
  std::unique_ptr<v1::QueryService::StubInterface> queries;
  std::unique_ptr<v1::SceneService::StubInterface> transfers;  // stub on `bulk`, for uploads, downloads and dumps
};

enum class Repeat { kNever, kWhenUnavailable };

// Parameters of a call in addition to its request.
struct CallPlan {
  absl::Duration deadline;
  RetryPolicy retry;
  Repeat repeat = Repeat::kNever;
  absl::string_view scene = {};  // empty if the call concerns no scene
  // True if the call is an update with a writer and a batch number: see outcome_unknown().
  bool numbered_update = false;
  absl::string_view route = {};  // scene by which a cluster chooses the server, if it is not `scene`
  Lane lane = Lane::kLatency;
};

// Choice of the server and of the revision for one query to a cluster. One thread at a time. The view of the query gets
// the highest revision that was seen of the scene, as the minimum, unless it names a revision itself. If a follower
// cannot answer so, the leader is asked.
class Reading {
 public:
  // `routes` must outlive the object. `view` is that of the caller.
  Reading(Routes& routes, absl::string_view scene, v1::View view, ReadFrom read_from);

  bool leader() const { return leader_; }
  void ask_leader() { leader_ = true; }
  // Returns the view that the next attempt sends.
  v1::View next_view();
  // Returns true if the query must be asked again, of the leader: a follower has not reached the revision, or the scene
  // has another epoch, which only the leader can tell.
  bool turns_to_leader(const absl::Status& failure);
  void answered(const Revision& revision) { routes_->saw(scene_, revision, leader_); }

 private:
  Routes* routes_;
  std::string scene_;
  v1::View view_;
  bool uses_floor_;
  bool sent_floor_ = false;
  bool leader_;
};

class Router {
 public:
  // Makes one attempt of a call at a server. May set `token` to the number of the token that the call carried; then the
  // call is repeated if the server refuses the token and there is a newer one.
  using Attempt = std::function<absl::Status(const ServerLinks& server, absl::Time deadline, uint64_t& token)>;
  using Open = std::function<absl::StatusOr<std::shared_ptr<const ServerLinks>>(const std::string& target)>;
  // Maximum number of connections to servers that a cluster has named; the least recently used one is closed.
  static constexpr size_t kMaxConnections = 64;

  // Makes a router of one server.
  explicit Router(std::shared_ptr<const ServerLinks> only);
  // Makes a router of a cluster. `given` are the servers of the user's addresses; `open` connects to further ones.
  Router(std::vector<std::shared_ptr<const ServerLinks>> given, Open open, const ClusterOptions& options);

  // Returns the only or first given server.
  const std::shared_ptr<const ServerLinks>& first() const { return given_.front(); }
  // Returns the targets, joined by commas.
  std::string address() const;
  // Returns null for one server.
  Routes* routes() { return routes_.get(); }
  const ClusterOptions& options() const { return options_; }
  RunningCalls& running() { return running_; }
  // Returns the policy of reconnection of a stream: in a cluster, one that outlasts a takeover.
  RetryPolicy reconnection(const RetryPolicy& asked) const;
  // Returns the choice for a query; nothing for one server.
  std::optional<Reading> reading(absl::string_view scene, const v1::View& view);

  // Runs a call: attempts it, as often as `plan` allows. In a cluster, a call that a server refused because another one
  // leads the scene, or because it shuts down, has changed nothing and is repeated, whatever it is. `reading`: null for
  // calls that are no queries.
  absl::Status run(const CallPlan& plan, const Attempt& attempt, Reading* reading = nullptr);

  // Returns the server for the next attempt.
  absl::StatusOr<std::shared_ptr<const ServerLinks>> server_for(absl::string_view scene, const Reading* reading);
  // Notes what the failure of an attempt says of servers. Returns true if another server may answer at once.
  bool note(absl::string_view scene, const std::string& target, const absl::Status& failure,
            const Reading* reading = nullptr);
  // Returns the error of a call or stream whose last attempt failed with `failure`.
  absl::Status gave_up(const absl::Status& failure) const;

 private:
  absl::Status run_in_cluster(const CallPlan& plan, const Attempt& attempt, Reading* reading);
  absl::StatusOr<std::shared_ptr<const ServerLinks>> connected(const std::string& target);
  // Asks the leader of a scene who follows it, and chooses a reader.
  void choose_reader(absl::string_view scene);

  const std::vector<std::shared_ptr<const ServerLinks>> given_;
  const Open open_;
  const ClusterOptions options_;
  const std::unique_ptr<Routes> routes_;
  RunningCalls running_;
  std::mutex mutex_;
  std::list<std::shared_ptr<const ServerLinks>> learned_;  // the least recently used first
};

// Returns true if a request that a member of a cluster answered with `failure` may succeed at another one, or later. A
// server that ends cancels calls.
bool moves_to_other_server(const absl::Status& failure);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_ROUTER_H_
