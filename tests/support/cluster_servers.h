// Servers of a cluster inside the test's process, on one PostgreSQL.
#ifndef LOCUS_TESTS_SUPPORT_CLUSTER_SERVERS_H_
#define LOCUS_TESTS_SUPPORT_CLUSTER_SERVERS_H_

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/services/cluster/cluster_storage.h"
#include "tests/support/postgres_server.h"
#include "tests/support/rpc_test.h"
#include "tests/support/running_server.h"

namespace locus::test {

// One member.
class ClusterServer {
 public:
  ClusterServer(const PostgresServer& engine, const std::string& zone, const std::string& http_listen = "") {
    server::ServerConfig config = test_config();
    config.http_listen = http_listen;
    config.cluster = engine.options().url;
    config.engine_replication = server::ReplicatedBy::kStorage;
    config.zone = zone;
    absl::StatusOr<server::ClusterStorage> opened = server::open_cluster(config);
    EXPECT_TRUE(opened.ok()) << opened.status();
    LOCUS_CHECK(opened.ok());
    storage_ = std::make_unique<server::ClusterStorage>(*std::move(opened));
    server_ = std::make_unique<RunningServer>(config, storage_->log.get(), storage_.get());
  }

  const std::string& address() const { return server_->address(); }
  Stubs& stubs() { return server_->stubs(); }
  server::Server& server() { return server_->server(); }

 private:
  std::unique_ptr<server::ClusterStorage> storage_;
  std::unique_ptr<RunningServer> server_;
};

// Calls `once` until it returns true, for up to about a minute, so that slow machines pass. Returns whether it did.
template <class Once>
bool becomes_true(const Once& once) {
  for (int i = 0; i < 3000; ++i) {
    if (once()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return false;
}

// Calls `call(stubs, context)` at one server after another, as a client that follows errors: REASON_ELSEWHERE names the
// next server, and UNAVAILABLE is repeated. Returns the last status. `at` is the index of the first server, and then of
// the one that answered.
template <class Call>
grpc::Status call_in_cluster(const std::vector<ClusterServer*>& servers, size_t& at, const Call& call) {
  grpc::Status status;
  uint64_t newest = 0;  // token of the last server that was named
  for (int i = 0; i < 2000; ++i) {
    grpc::ClientContext context;
    set_timeout(context);
    status = call(servers[at]->stubs(), context);
    if (status.error_code() == grpc::StatusCode::UNAVAILABLE) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      continue;
    }
    if (status.ok()) return status;
    const v1::Error error = error_of(status);
    if (error.reason() != v1::REASON_ELSEWHERE) return status;
    if (error.token() < newest) {  // this server does not know yet that it leads the scene, as another one has said
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      continue;
    }
    newest = error.token();
    for (size_t next = 0; next < servers.size(); ++next)
      if (servers[next]->address() == error.addresses(0)) at = next;
  }
  return status;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_CLUSTER_SERVERS_H_
