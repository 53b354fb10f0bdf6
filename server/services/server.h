// The whole server behind its addresses: builds the services, listens, and ends in order. What main() runs, and what
// tests run inside their own process.
//
// Threads: addresses() and port() from any thread; drain() once, from one.
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
  // Listens on every address of `config` or on none: an error names the address and the reason. Scenes are kept in
  // `log`, which outlives the server, or in memory only where there is none. What the log has is read back before this
  // returns; meanwhile calls are answered with REASON_RECOVERING. CANCELLED soon after `stop` is true, if it is then
  // still at that.
  static absl::StatusOr<std::unique_ptr<Server>> start(const ServerConfig& config, UpdateLog* log = nullptr,
                                                       const std::atomic<bool>& stop = kNever);

  // Ends without grace if drain() was not called.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // As clients write them, bound ports filled in, in the order of the config.
  const std::vector<std::string>& addresses() const { return addresses_; }
  // Of the first TCP address; 0 without one.
  uint16_t port() const { return port_; }
  // Of the HTTP port; 0 without one.
  uint16_t http_port() const;

  // Says NOT_SERVING, ends streams and new calls with REASON_DRAINING, lets calls in work finish within `grace`, cuts
  // off the rest, and returns when nothing runs any more.
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
