// Fixture of tests of PostgresLog on a server of their own, which several logs may share. One thread.
#ifndef LOCUS_TESTS_SUPPORT_POSTGRES_LOG_FIXTURE_H_
#define LOCUS_TESTS_SUPPORT_POSTGRES_LOG_FIXTURE_H_

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "server/storage/postgres_log.h"
#include "tests/support/log_fixture.h"
#include "tests/support/postgres_server.h"

namespace locus::test {

class PostgresLogFixture : public LogFixture {
 protected:
  void SetUp() override {
    if (!PostgresServer::installed()) GTEST_SKIP() << PostgresServer::kMissing;
    engine_ = std::make_unique<PostgresServer>();
    own_ = open_log(engine_->options());
    log_ = std::unique_ptr<UpdateLog>(own_);
    ASSERT_NE(log_, nullptr);
  }
  // Opens a log; null, after a failure of the test, if that fails.
  static server::PostgresLog* open_log(const server::PostgresOptions& options) {
    auto log = server::PostgresLog::open(options);
    EXPECT_TRUE(log.ok()) << log.status();
    return log.ok() ? log->release() : nullptr;
  }
  std::unique_ptr<server::PostgresLog> another(const server::PostgresOptions& options) const {
    return std::unique_ptr<server::PostgresLog>(open_log(options));
  }
  std::unique_ptr<server::PostgresLog> another() const { return another(engine_->options()); }
  // Returns the use of the mesh that add_mesh() adds with this number.
  static server::MeshUse use_of(const std::string& name, uint8_t number, uint64_t instances) {
    return {name, hash_of(number), instances};
  }

  std::unique_ptr<PostgresServer> engine_;
  server::PostgresLog* own_ = nullptr;  // log_ by its type
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_POSTGRES_LOG_FIXTURE_H_
