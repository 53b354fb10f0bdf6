#include "server/config/config_origins.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <map>
#include <set>

#include "server/config/machine.h"

namespace locus::server {
namespace {

using ::testing::HasSubstr;

class ConfigOriginsTest : public testing::Test {
 protected:
  ~ConfigOriginsTest() override { std::remove(file_.c_str()); }

  absl::StatusOr<std::vector<ConfigValue>> origins(const std::vector<std::string>& arguments) {
    return config_origins(arguments, [this](const std::string& name) -> std::optional<std::string> {
      const auto variable = environment_.find(name);
      return variable == environment_.end() ? std::nullopt : std::optional<std::string>(variable->second);
    });
  }

  // Returns the value of the option `name` as "value, origin, place".
  std::string of(const std::string& name, const std::vector<std::string>& arguments = {}) {
    const auto values = origins(arguments);
    EXPECT_TRUE(values.ok()) << values.status();
    if (values.ok())
      for (const ConfigValue& value : *values)
        if (value.name == name) return value.value + ", " + origin_name(value.origin) + ", " + value.place;
    return "not there";
  }

  void write_file(const std::string& text) { std::ofstream(file_) << text; }

  std::map<std::string, std::string> environment_;
  std::string file_ =
      testing::TempDir() + "locusd_" + testing::UnitTest::GetInstance()->current_test_info()->name() + ".conf";
};

TEST_F(ConfigOriginsTest, WithoutFlagsEnvironmentAndFileAllValuesAreDefaults) {
  const auto values = origins({});
  ASSERT_TRUE(values.ok()) << values.status();
  std::set<std::string> names;
  for (const ConfigValue& value : *values) {
    EXPECT_EQ(value.origin, Origin::kDefault) << value.name;
    EXPECT_EQ(value.place, "") << value.name;
    names.insert(value.name);
  }
  EXPECT_EQ(names.size(), values->size());
  for (const char* name : {"listen", "http-listen", "log-level", "insecure", "max-scenes", "slow-query-ms"})
    EXPECT_TRUE(names.contains(name)) << name;
  EXPECT_FALSE(names.contains("config"));
  EXPECT_EQ(of("listen"), "127.0.0.1:7575, default, ");
  EXPECT_EQ(of("log-level"), "info, default, ");
  EXPECT_EQ(of("insecure"), "false, default, ");
}

TEST_F(ConfigOriginsTest, DefaultsComputedFromTheMachineShowTheirValue) {
  EXPECT_EQ(of("memory-limit"), std::to_string(read_machine().memory_bytes / 4 * 3) + ", default, ");
}

TEST_F(ConfigOriginsTest, EachValueNamesItsFlagVariableOrLine) {
  write_file("# limits\nmax-scenes = 1\n  max-streams=1\nmax-calls = 1\n\nlog-format = json\n");
  environment_ = {{"LOCUS_CONFIG", file_}, {"LOCUS_MAX_SCENES", "2"}, {"LOCUS_MAX_STREAMS", "2"}};
  const std::vector<std::string> flags = {"--max-scenes", "3", "--insecure", "--log-level=debug"};
  EXPECT_EQ(of("max-scenes", flags), "3, flag, --max-scenes");
  EXPECT_EQ(of("insecure", flags), "true, flag, --insecure");
  EXPECT_EQ(of("log-level", flags), "debug, flag, --log-level");
  EXPECT_EQ(of("max-streams", flags), "2, environment, LOCUS_MAX_STREAMS");
  EXPECT_EQ(of("max-calls", flags), "1, file, " + file_ + ":4");
  EXPECT_EQ(of("log-format", flags), "json, file, " + file_ + ":6");
  EXPECT_EQ(of("max-meshes", flags), "65536, default, ");
}

TEST_F(ConfigOriginsTest, EachFlagWithoutAValueShowsItsOwnValue) {
  EXPECT_EQ(of("accept-compression", {"--accept-compression"}), "true, flag, --accept-compression");
  EXPECT_EQ(of("insecure", {"--accept-compression"}), "false, default, ");
  EXPECT_EQ(of("accept-compression", {"--insecure"}), "false, default, ");
  EXPECT_EQ(of("insecure", {"--insecure"}), "true, flag, --insecure");
}

TEST_F(ConfigOriginsTest, AConfigFileNamedByAFlagIsRead) {
  write_file("memory-limit = 1GiB\n");
  EXPECT_EQ(of("memory-limit", {"--config", file_}), "1073741824, file, " + file_ + ":1");
}

TEST_F(ConfigOriginsTest, SeveralAddressesAreListedAsOneValue) {
  EXPECT_EQ(of("listen", {"--listen", "127.0.0.1:1", "--listen", "[::1]:2"}), "127.0.0.1:1,[::1]:2, flag, --listen");
}

TEST_F(ConfigOriginsTest, AnEmptyVariableSetsOnlyOptionsThatMayBeEmpty) {
  environment_ = {{"LOCUS_HTTP_LISTEN", ""}, {"LOCUS_MAX_SCENES", ""}};
  EXPECT_EQ(of("http-listen"), ", environment, LOCUS_HTTP_LISTEN");
  EXPECT_EQ(of("max-scenes"), "1024, default, ");
}

TEST_F(ConfigOriginsTest, OptionsThatTheDaemonRefusesGiveTheSameError) {
  const auto values = origins({"--max-scenes", "0"});
  EXPECT_EQ(values.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(values.status().message()), HasSubstr("--max-scenes"));
  EXPECT_THAT(std::string(origins({"--listen", "0.0.0.0:1"}).status().message()), HasSubstr("two other ways"));
}

TEST_F(ConfigOriginsTest, TheCommandConfigPrintsOptionsInUseAndStartsNothing) {
  const auto none = [](const std::string&) { return std::optional<std::string>(); };
  const Invocation shown = read_invocation({"config", "--max-scenes", "3"}, none);
  EXPECT_EQ(shown.exit_code, 0);
  EXPECT_FALSE(shown.config);
  EXPECT_FALSE(shown.maintenance);
  EXPECT_THAT(shown.text, testing::ContainsRegex("max-scenes +3 +flag +--max-scenes\n"));
  EXPECT_THAT(shown.text, testing::ContainsRegex("log-level +info +default +-\n"));
  const Invocation json = read_invocation({"config", "--json", "--max-scenes", "3"}, none);
  EXPECT_THAT(json.text, HasSubstr(R"({"option":"max-scenes","value":"3","origin":"flag","place":"--max-scenes"})"));
  EXPECT_EQ(read_invocation({"config", "--max-scenes", "many"}, none).exit_code, 2);
}

}  // namespace
}  // namespace locus::server
