#include "server/config/server_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>

#include "absl/strings/str_cat.h"
#include "server/config/machine.h"

namespace locus::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class ServerConfigTest : public testing::Test {
 protected:
  ~ServerConfigTest() override { std::remove(file_.c_str()); }

  Invocation read(const std::vector<std::string>& arguments) {
    return read_invocation(arguments, [this](const std::string& name) -> std::optional<std::string> {
      const auto variable = environment_.find(name);
      return variable == environment_.end() ? std::nullopt : std::optional<std::string>(variable->second);
    });
  }

  void write_file(const std::string& text) { std::ofstream(file_) << text; }

  std::map<std::string, std::string> environment_;
  std::string file_ =
      testing::TempDir() + "locusd_" + testing::UnitTest::GetInstance()->current_test_info()->name() + ".conf";
};

TEST_F(ServerConfigTest, WithoutOptionsTheDefaultsApply) {
  const Invocation invocation = read({});
  ASSERT_TRUE(invocation.config.has_value()) << invocation.text;
  EXPECT_THAT(invocation.config->listen, ElementsAre("127.0.0.1:7575"));
  EXPECT_EQ(invocation.config->drain_grace_s, 10u);
  EXPECT_GE(invocation.config->threads, 1u);
  EXPECT_EQ(invocation.config->log_level, LogLevel::kInfo);
  EXPECT_FALSE(invocation.config->insecure);
}

TEST_F(ServerConfigTest, AFlagWinsOverTheEnvironmentWhichWinsOverTheFile) {
  write_file("# limits\nmax-scenes = 1\nmax-streams = 1\nmax-calls = 1\nlog-format = json\n");
  environment_ = {{"LOCUS_CONFIG", file_}, {"LOCUS_MAX_SCENES", "2"}, {"LOCUS_MAX_STREAMS", "2"}};
  const Invocation invocation = read({"--max-scenes", "3"});
  ASSERT_TRUE(invocation.config.has_value()) << invocation.text;
  EXPECT_EQ(invocation.config->max_scenes, 3u);
  EXPECT_EQ(invocation.config->max_streams, 2u);
  EXPECT_EQ(invocation.config->max_calls, 1u);
  EXPECT_EQ(invocation.config->log_format, LogFormat::kJson);
}

TEST_F(ServerConfigTest, CheckAndRepairTakeTheDirectoryFromTheLineOrFromTheOption) {
  const Invocation check = read({"check", "/data"});
  ASSERT_TRUE(check.maintenance.has_value()) << check.text;
  EXPECT_EQ(check.maintenance->task, Maintenance::Task::kCheck);
  EXPECT_EQ(check.maintenance->directory, "/data");
  EXPECT_FALSE(check.config.has_value());
  environment_ = {{"LOCUS_DATA_DIR", "/kept"}};
  const Invocation repair = read({"repair"});
  ASSERT_TRUE(repair.maintenance.has_value()) << repair.text;
  EXPECT_EQ(repair.maintenance->task, Maintenance::Task::kRepair);
  EXPECT_EQ(repair.maintenance->directory, "/kept");
}

TEST_F(ServerConfigTest, CheckAndRepairChooseWhenToShowProgress) {
  EXPECT_EQ(read({"check", "/data"}).maintenance->progress, ProgressChoice::kAuto);
  EXPECT_EQ(read({"repair", "/data", "--progress", "always"}).maintenance->progress, ProgressChoice::kAlways);
  EXPECT_EQ(read({"check", "/data", "--progress", "sometimes"}).exit_code, 2);
}

TEST_F(ServerConfigTest, CheckWithoutADirectoryIsAMistake) {
  const Invocation invocation = read({"check"});
  EXPECT_FALSE(invocation.maintenance.has_value());
  EXPECT_EQ(invocation.exit_code, 2);
  EXPECT_THAT(invocation.text, HasSubstr("no data directory"));
}

TEST_F(ServerConfigTest, CheckHasItsOwnHelp) {
  const Invocation invocation = read({"check", "--help"});
  EXPECT_EQ(invocation.exit_code, 0);
  EXPECT_THAT(invocation.text, HasSubstr("locusd check /var/lib/locus"));
}

TEST_F(ServerConfigTest, BatchPriorityIsNiceOrIdle) {
  EXPECT_EQ(read({}).config->batch_priority, BatchPriority::kNice);
  EXPECT_EQ(read({"--batch-priority", "idle"}).config->batch_priority, BatchPriority::kIdle);
  const Invocation wrong = read({"--batch-priority", "high"});
  EXPECT_FALSE(wrong.config.has_value());
  EXPECT_THAT(wrong.text, HasSubstr("batch-priority"));
}

TEST_F(ServerConfigTest, ListenFlagsReplaceThoseOfTheEnvironment) {
  environment_ = {{"LOCUS_LISTEN", "127.0.0.1:1,unix:/tmp/a.sock"}};
  EXPECT_THAT(read({}).config->listen, ElementsAre("127.0.0.1:1", "unix:/tmp/a.sock"));
  EXPECT_THAT(read({"--listen", "127.0.0.1:2", "--listen", "127.0.0.1:3"}).config->listen,
              ElementsAre("127.0.0.1:2", "127.0.0.1:3"));
}

TEST_F(ServerConfigTest, TheFileMayListAddresses) {
  write_file("listen = 127.0.0.1:1, unix:/tmp/a.sock\n");
  const Invocation invocation = read({"--config", file_});
  ASSERT_TRUE(invocation.config.has_value()) << invocation.text;
  EXPECT_THAT(invocation.config->listen, ElementsAre("127.0.0.1:1", "unix:/tmp/a.sock"));
}

TEST_F(ServerConfigTest, MistakesEndWithTwoAndNameTheOption) {
  write_file("no-such-option = 1\n");
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"--max-scenes", "0"}, "--max-scenes"},
      {{"--max-scenes", "1000000"}, "--max-scenes"},
      {{"--threads", "many"}, "--threads"},
      {{"--log-level", "loud"}, "--log-level"},
      {{"--listen", "nowhere"}, "nowhere"},
      {{"--no-such-option"}, "--no-such-option"},
      {{"--thread", "2"}, "there is no option `--thread`; did you mean `--threads`?"},
      {{"config", "--json", "--thread=2"}, "there is no option `--thread`; did you mean `--threads`?"},
      {{"config", "--jsno"}, "did you mean `--json`?"},
      {{"--lisen=127.0.0.1:1", "--threads", "2"}, "did you mean `--listen`?"},
      {{"--memory-limit", "lots"}, "--memory-limit"},
      {{"--memory-limit", "1"}, "64MiB"},
      {{"--memory-limit", "2PiB"}, "1PiB"},
      {{"--memory-limit", "-1"}, "--memory-limit"},
      {{"--pinned-limit", "1023"}, "1MiB"},
      {{"--pinned-limit", "2PiB"}, "1PiB"},
      {{"--config", file_}, "no-such-option"},
      {{"--config", "/no/such/file"}, "/no/such/file"},
  };
  for (const auto& [arguments, named] : cases) {
    const Invocation invocation = read(arguments);
    EXPECT_FALSE(invocation.config.has_value()) << named;
    EXPECT_EQ(invocation.exit_code, 2) << named;
    EXPECT_THAT(invocation.text, HasSubstr(named));
    EXPECT_THAT(invocation.text, HasSubstr("--help"));
  }
}

TEST_F(ServerConfigTest, MistakesInTheFileNameItsLine) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"max-scenes = 2\nthread = 1\n", ":2: there is no option `thread` of the file; did you mean `threads`?"},
      {"# one\n\nnonsense\nthread = 1\n", ":3: there is no option `nonsense` of the file"},
      {"listen = [127.0.0.1:1,\n 127.0.0.1:2]\nno-such-option = 1\n", ":3: there is no option `no-such-option`"},
      {"threads = 1\n[more]\nmax-scenes = 2\n", ":2: there is no option `[more]`"},
      {"more.threads = 1\n", ":1: there is no option `more.threads`"},
      {"help = true\n", ":1: there is no option `help`"},
      {"max-streams = 1\n\nmax-scenes = 0\n", ":3: --max-scenes: "},
      {"threads = many\n", ":1: --threads: "}};
  for (const auto& [text, message] : cases) {
    write_file(text);
    const Invocation invocation = read({"--config", file_});
    EXPECT_EQ(invocation.exit_code, 2) << text;
    EXPECT_THAT(invocation.text, HasSubstr(absl::StrCat("locusd: ", file_, message))) << text;
  }
}

TEST_F(ServerConfigTest, AMistakeInAFlagOrVariableIsNotBlamedOnTheFile) {
  write_file("threads = 1\n");
  EXPECT_THAT(read({"--config", file_, "--threads", "many"}).text, HasSubstr("locusd: --threads: "));
  EXPECT_THAT(read({"--config", file_, "--max-scenes", "0"}).text, HasSubstr("locusd: --max-scenes: "));
  environment_ = {{"LOCUS_CONFIG", file_}, {"LOCUS_THREADS", "many"}};
  EXPECT_THAT(read({}).text, HasSubstr("locusd: --threads: "));
}

TEST_F(ServerConfigTest, NonLocalAddressesNeedTlsAndAnAccessFileOrInsecure) {
  const Invocation refused = read({"--listen", "0.0.0.0:7575"});
  EXPECT_FALSE(refused.config.has_value());
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.text, HasSubstr("missing: --tls-cert, --tls-key, --access-file."));
  EXPECT_THAT(refused.text, HasSubstr("locusd --listen 0.0.0.0:7575 --tls-cert server.crt --tls-key server.key "
                                      "--access-file access.conf"));
  EXPECT_THAT(refused.text, HasSubstr("two other ways"));
  EXPECT_THAT(refused.text, HasSubstr("127.0.0.1"));
  EXPECT_THAT(refused.text, HasSubstr("LOCUS_INSECURE=1 or --insecure"));
  EXPECT_TRUE(read({"--listen", "0.0.0.0:7575", "--insecure"}).config.has_value());
  environment_ = {{"LOCUS_INSECURE", "1"}};
  EXPECT_TRUE(read({"--listen", "0.0.0.0:7575"}).config.has_value());
  environment_ = {{"LOCUS_INSECURE", "0"}};
  EXPECT_FALSE(read({"--listen", "0.0.0.0:7575"}).config.has_value());
}

TEST_F(ServerConfigTest, ARefusalNamesOnlyWhatIsMissing) {
  const std::vector<std::string> with_tls = {"--listen", "[::]:1", "--tls-cert", "a.crt", "--tls-key", "a.key"};
  const Invocation refused = read(with_tls);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.text, HasSubstr("missing: --access-file."));
  EXPECT_THAT(refused.text, HasSubstr("--listen [::]:1 --tls-cert a.crt --tls-key a.key --access-file access.conf"));
  std::vector<std::string> complete = with_tls;
  complete.insert(complete.end(), {"--access-file", "access"});
  const Invocation accepted = read(complete);
  ASSERT_TRUE(accepted.config.has_value()) << accepted.text;
  EXPECT_EQ(accepted.config->tls_cert, "a.crt");
  EXPECT_EQ(accepted.config->access_file, "access");
  EXPECT_FALSE(accepted.config->insecure);
}

TEST_F(ServerConfigTest, ACertificateNeedsItsKeyAndAClientCaNeedsBoth) {
  EXPECT_THAT(read({"--tls-cert", "a"}).text, HasSubstr("belong together"));
  EXPECT_THAT(read({"--tls-key", "a"}).text, HasSubstr("belong together"));
  EXPECT_THAT(read({"--tls-client-ca", "a"}).text, HasSubstr("--tls-client-ca needs --tls-cert"));
  EXPECT_TRUE(read({"--tls-cert", "a", "--tls-key", "b", "--tls-client-ca", "c"}).config.has_value());
}

TEST_F(ServerConfigTest, LimitsOfConnectionsHaveDefaultsAndRanges) {
  const ServerConfig config = *read({}).config;
  EXPECT_EQ(config.max_connections, 0u);
  EXPECT_EQ(config.max_connections_per_address, 1024u);
  EXPECT_EQ(config.max_new_connections, 200u);
  EXPECT_EQ(config.handshake_timeout_s, 10u);
  EXPECT_EQ(config.idle_timeout_s, 0u);
  EXPECT_EQ(config.unix_mode, "0600");
  EXPECT_FALSE(config.accept_compression);
  EXPECT_TRUE(read({"--accept-compression"}).config->accept_compression);
  EXPECT_EQ(read({"--handshake-timeout-s", "0"}).exit_code, 2);
  EXPECT_EQ(read({"--max-new-connections", "0"}).exit_code, 2);
  EXPECT_EQ(read({"--unix-mode", "rw"}).exit_code, 2);
  EXPECT_EQ(read({"--audit-bytes", "1"}).exit_code, 2);
  EXPECT_EQ(read({"--audit-bytes", "2MiB"}).config->audit_bytes, uint64_t{2} << 20);
}

TEST_F(ServerConfigTest, TheHttpPortFollowsTheSameRuleAndCanBeTurnedOff) {
  EXPECT_EQ(read({}).config->http_listen, "127.0.0.1:7576");
  EXPECT_EQ(read({"--http-listen", ""}).config->http_listen, "");
  EXPECT_EQ(read({"--http-listen", "[::1]:1"}).config->http_listen, "[::1]:1");
  EXPECT_THAT(read({"--http-listen", "0.0.0.0:7576"}).text, HasSubstr("missing: --tls-cert, --tls-key, --access-file"));
  const std::vector<std::string> protection = {"--tls-cert", "a", "--tls-key", "b", "--access-file", "c"};
  std::vector<std::string> pages = {"--http-listen", "0.0.0.0:7576"};
  pages.insert(pages.end(), protection.begin(), protection.end());
  EXPECT_TRUE(read(pages).config.has_value());
  EXPECT_TRUE(read({"--http-listen", "0.0.0.0:7576", "--insecure"}).config.has_value());
  EXPECT_THAT(read({"--http-listen", "unix:/tmp/a.sock"}).text, HasSubstr("scrapers use TCP"));
  EXPECT_THAT(read({"--http-listen", "nowhere"}).text, HasSubstr("nowhere"));
  EXPECT_THAT(read({"--http-listen", "", "--http-port-file", "p"}).text, HasSubstr("needs an HTTP port"));
  environment_ = {{"LOCUS_HTTP_LISTEN", ""}};
  EXPECT_EQ(read({}).config->http_listen, "");
  write_file("http-listen = \"\"\n");
  environment_ = {};
  EXPECT_EQ(read({"--config", file_}).config->http_listen, "");
}

TEST_F(ServerConfigTest, AMemberOfAClusterNeedsAnAddressThatOthersReachAndNoDirectory) {
  const std::string engine = "postgresql://a,b,c/locus";
  EXPECT_EQ(read({}).config->cluster, "");
  const ServerConfig member = *read({"--cluster", engine, "--zone", "z"}).config;
  EXPECT_EQ(member.cluster, engine);
  EXPECT_EQ(member.zone, "z");
  EXPECT_EQ(member.engine_replication, ReplicatedBy::kStandbys);
  EXPECT_EQ(read({"--cluster", engine, "--engine-replication", "storage"}).config->engine_replication,
            ReplicatedBy::kStorage);
  EXPECT_THAT(read({"--cluster", engine, "--engine-replication", "hope"}).text, HasSubstr("--engine-replication"));
  EXPECT_THAT(read({"--cluster", engine, "--data-dir", "d"}).text, HasSubstr("exclude each other"));
  EXPECT_THAT(read({"--cluster", engine, "--listen", "unix:/tmp/a.sock"}).text, HasSubstr("needs a TCP address"));
  EXPECT_THAT(read({"--cluster", engine, "--listen", "0.0.0.0:1", "--insecure"}).text, HasSubstr("--advertise"));
  EXPECT_EQ(
      read({"--cluster", engine, "--listen", "0.0.0.0:1", "--insecure", "--advertise", "a:7575"}).config->advertise,
      "a:7575");
  for (const char* const wrong : {"a", "a:0", "unix:/tmp/a.sock"})
    EXPECT_THAT(read({"--cluster", engine, "--advertise", wrong}).text, HasSubstr("--advertise")) << wrong;
  EXPECT_THAT(read({"--advertise", "a:7575"}).text, HasSubstr("give --cluster too"));
  environment_ = {{"LOCUS_CLUSTER", engine}};
  EXPECT_EQ(read({}).config->cluster, engine) << "commas do not divide it";
  environment_ = {};
  write_file("cluster = \"" + engine + "\"\n");
  EXPECT_EQ(read({"--config", file_}).config->cluster, engine);
}

TEST_F(ServerConfigTest, ThreadsAndMemoryFollowTheMachineUnlessGiven) {
  const Machine machine = read_machine();
  const ServerConfig followed = *read({}).config;
  EXPECT_EQ(followed.threads, std::min(machine.cores, limits::kMaxThreads));
  EXPECT_EQ(followed.memory_limit, machine.memory_bytes / 4 * 3);
  EXPECT_EQ(followed.pinned_limit, 0u);
  const ServerConfig given = *read({"--threads", "7", "--memory-limit", "512MiB", "--pinned-limit", "2MiB"}).config;
  EXPECT_EQ(given.pinned_limit, uint64_t{2} << 20);
  EXPECT_EQ(given.threads, 7u);
  EXPECT_EQ(given.memory_limit, uint64_t{512} << 20);
}

TEST_F(ServerConfigTest, SizesAreReadFromTheEnvironmentAndTheFileToo) {
  write_file("memory-limit = 2GiB\n");
  EXPECT_EQ(read({"--config", file_}).config->memory_limit, uint64_t{2} << 30);
  environment_ = {{"LOCUS_CONFIG", file_}, {"LOCUS_MEMORY_LIMIT", "1g"}};
  EXPECT_EQ(read({}).config->memory_limit, uint64_t{1} << 30);
}

TEST_F(ServerConfigTest, HelpExplainsWithExamplesAndEndsWithZero) {
  const Invocation help = read({"--help"});
  EXPECT_FALSE(help.config.has_value());
  EXPECT_EQ(help.exit_code, 0);
  for (const char* part : {"Examples:", "--listen", "--port-file", "LOCUS_DRAIN_GRACE_S", "--config", "memory"})
    EXPECT_THAT(help.text, HasSubstr(part));
  EXPECT_THAT(help.text, HasSubstr("\nUsage: locusd [OPTIONS]"));
  EXPECT_EQ(help.text.back(), '\n');
  const Invocation version = read({"--version"});
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_EQ(version.text, "locusd " LOCUS_VERSION "\n");
}

}  // namespace
}  // namespace locus::server
