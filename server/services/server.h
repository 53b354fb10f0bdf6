// The complete server: builds the services, listens on the addresses, and shuts down in order. main() runs it, and
// tests run it inside their own process.
//
// Threads: any thread may call the const functions. Call drain() at most once.
#ifndef LOCUS_SERVER_SERVICES_SERVER_H_
#define LOCUS_SERVER_SERVICES_SERVER_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/scene/log/update_log.h"
#include "server/config/server_config.h"

namespace grpc {
class Channel;
class ChannelArguments;
}  // namespace grpc

namespace locus::server {

struct ClusterStorage;

class Server {
 public:
  // Starts a server that listens on all addresses of `config`. If there are none, only callers in this process can call
  // the server (in_process_channel()), and it uses nothing of the connections' protection: no sockets, no threads of
  // the guard, and no functions in place of the system's (rpc/read_hooks.cc). If it cannot listen on an address,
  // returns an error that names the address and the reason. Scenes are stored in `log`, which must outlive the server;
  // if `log` is null, scenes are stored in memory only. The scenes of the log are recovered before start() returns;
  // meanwhile calls are answered with REASON_RECOVERING. Returns CANCELLED soon after `stop` becomes true during
  // recovery. With `cluster`, which must outlive the server and whose log `log` is, the server is a member of a
  // cluster: it reads the scenes that it is given to lead, after start() has returned.
  static absl::StatusOr<std::unique_ptr<Server>> start(const ServerConfig& config, UpdateLog* log = nullptr,
                                                       const std::atomic<bool>& stop = kNever,
                                                       ClusterStorage* cluster = nullptr);

  // Drains without a grace period if drain() was not called.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // Returns a channel from this process to the server, without a socket. The channel may outlive the server; then its
  // calls fail with UNAVAILABLE. The server sees all callers of such channels as one peer (peer_in_process()).
  // Precondition: the config has no addresses, and drain() was not called.
  std::shared_ptr<grpc::Channel> in_process_channel(const grpc::ChannelArguments& arguments) const;

  // Returns the addresses as clients write them, with the bound ports, in the order of the config.
  const std::vector<std::string>& addresses() const;
  // Returns the port of the first TCP address; 0 if there is no TCP address.
  uint16_t port() const;
  // Returns the port of the HTTP pages; 0 if they are not served.
  uint16_t http_port() const;

  // Reads the files of TLS immediately. The server also reads them by itself each second. Returns true if the files
  // have changed and the new contents are in use.
  bool reload_tls();
  // Reads all files of access control and TLS again. A file with a mistake is logged, and the old content stays in use.
  void reload();

  // Shuts down. Health reports NOT_SERVING; streams and new calls end with REASON_DRAINING. Running calls may finish
  // within `grace` and are cancelled after it. Returns when no call runs any more. If `before_closing` is set, drain()
  // calls it when all calls have ended or were cancelled, and before it closes the connections and channels.
  void drain(std::chrono::milliseconds grace, const std::function<void()>& before_closing = nullptr);

 private:
  static inline const std::atomic<bool> kNever{false};
  struct Parts;
  explicit Server(std::unique_ptr<Parts> parts);

  std::unique_ptr<Parts> parts_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SERVER_H_
