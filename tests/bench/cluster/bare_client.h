// A program that does nothing but append: one blocking libpq connection for each scene, and the statement of
// PostgresLog, prepared. Its commits are not shared. One thread for each scene.
#ifndef LOCUS_TESTS_BENCH_CLUSTER_BARE_CLIENT_H_
#define LOCUS_TESTS_BENCH_CLUSTER_BARE_CLIENT_H_

#include <libpq-fe.h>

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace locus::bench::cluster {

class BareClient {
 public:
  // Connects and creates a scene of this name.
  static absl::StatusOr<BareClient> create(const std::string& url, const std::string& scene);

  absl::Status append(const std::string& record);
  // Returns the bytes of all records, in order.
  absl::StatusOr<std::string> read_all();

 private:
  explicit BareClient(PGconn* connection) : connection_(connection, &PQfinish) {}

  std::unique_ptr<PGconn, decltype(&PQfinish)> connection_;
  uint64_t key_ = 0;
  uint64_t last_ = 0;
};

}  // namespace locus::bench::cluster

#endif  // LOCUS_TESTS_BENCH_CLUSTER_BARE_CLIENT_H_
