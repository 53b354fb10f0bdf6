// A locus server inside the caller's process: for tests, and for tools of one process. It runs the code of locusd,
// behind gRPC's in-process channel instead of a socket. README.md in this folder says what it costs and what it is not
// for.
//
//   auto server = locus::client::EmbeddedServer::start();
//   if (!server.ok()) return server.status();
//   auto client = (*server)->connect();  // a locus::client::Client, with streams and batchers
//
// A process may run any number of servers, at the same time and one after another. The server starts threads of its
// own. It opens no port, installs no signal handlers, changes no limits of the process, and writes nothing to standard
// output; warnings and errors are lines on standard error, as from locusd. There is no access control: every caller
// that has the object may make every call.
#ifndef LOCUS_CLIENT_EMBEDDED_EMBEDDED_SERVER_H_
#define LOCUS_CLIENT_EMBEDDED_EMBEDDED_SERVER_H_

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "client/lib/client.h"
#include "client/lib/options.h"

namespace locus::client {

struct EmbeddedOptions {
  // Directory in which scenes and meshes are stored; empty = in memory only. Created if it is missing. One server at a
  // time can use it, and locusd can use it when the embedded server has ended.
  std::string data_dir = {};
  // Number of threads that may work on one query batch; 0 = one for each core that the process may use.
  uint32_t threads = 0;
  // Bytes of memory that the whole process may use before the server refuses work; 0 = three quarters of the memory of
  // the machine or its control group. The memory of the rest of the program counts.
  uint64_t memory_limit = 0;
};

// Thread-safe, except that the destructor must not run at the same time as another member.
class EmbeddedServer {
 public:
  // Starts a server and recovers the scenes of the data directory, if there is one. Returns FAILED_PRECONDITION if
  // another server uses the directory, and the errors of the storage.
  static absl::StatusOr<std::unique_ptr<EmbeddedServer>> start(const EmbeddedOptions& options = {});

  // Ends the server: calls that still run are cancelled, and later calls of its clients fail with UNAVAILABLE. Blocks
  // until the server's threads have ended. With a data directory, every acknowledged update is on the disk then.
  ~EmbeddedServer();
  EmbeddedServer(const EmbeddedServer&) = delete;
  EmbeddedServer& operator=(const EmbeddedServer&) = delete;

  // Returns a client of this server. It may outlive the server. `options`: see Client::in_process(); the message sizes
  // have their effect here.
  std::unique_ptr<Client> connect(const ClientOptions& options = {}) const;

 private:
  struct Parts;
  explicit EmbeddedServer(std::unique_ptr<Parts> parts);

  std::unique_ptr<Parts> parts_;
};

}  // namespace locus::client

#endif  // LOCUS_CLIENT_EMBEDDED_EMBEDDED_SERVER_H_
