// The complete server: builds the services, listens on the addresses, and shuts down in order. Run by main(), and by
// tests inside their own process.
//
// Threads: addresses() and port() from any thread; drain() once, from one thread.
#ifndef LOCUS_SERVER_SERVICES_SERVER_H_
#define LOCUS_SERVER_SERVICES_SERVER_H_

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/scene/log/update_log.h"
#include "server/config/server_config.h"

namespace locus::server {

class Server {
 public:
  // Starts a server that listens on all addresses of `config`; otherwise returns an error that names the address and
  // the reason. Scenes are stored in `log`, which must outlive the server, or in memory only if `log` is null. The
  // scenes of the log are recovered before this returns; meanwhile calls are answered with REASON_RECOVERING. Returns
  // CANCELLED soon after `stop` becomes true during recovery.
  static absl::StatusOr<std::unique_ptr<Server>> start(const ServerConfig& config, UpdateLog* log = nullptr,
                                                       const std::atomic<bool>& stop = kNever);

  // Drains without a grace period if drain() was not called.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // Returns the addresses as clients write them, with the bound ports, in the order of the config.
  const std::vector<std::string>& addresses() const { return addresses_; }
  // Returns the port of the first TCP address; 0 without one.
  uint16_t port() const { return port_; }
  // Returns the port of the HTTP pages; 0 without one.
  uint16_t http_port() const;

  // Shuts down: health reports NOT_SERVING, streams and new calls end with REASON_DRAINING, running calls may finish
  // within `grace` and are cancelled after it. Returns when no call runs any more.
  void drain(std::chrono::milliseconds grace);

 private:
  static inline const std::atomic<bool> kNever{false};
  struct Parts;
  explicit Server(std::unique_ptr<Parts> parts);

  std::unique_ptr<Parts> parts_;
  std::vector<std::string> addresses_;
  uint16_t port_ = 0;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_SERVER_H_
