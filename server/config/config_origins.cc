#include "server/config/config_origins.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "core/base/check.h"
#include "server/config/config_file.h"
#include "server/config/server_parser.h"

namespace locus::server {
namespace {

// Options that are flags without a value.
constexpr std::pair<absl::string_view, bool ServerConfig::*> kFlags[] = {
    {"accept-compression", &ServerConfig::accept_compression}, {"insecure", &ServerConfig::insecure}};

// Returns the option's value as text. The parser was built for `config`, which holds the values in use, so CLI11
// reports these values as the defaults of the options.
std::string value_of(const CLI::Option& option, const ServerConfig& config) {
  if (option.get_expected_max() == 0) {  // a flag without a value
    for (const auto& [name, member] : kFlags)
      if (option.check_lname(std::string(name))) return config.*member ? "true" : "false";
    LOCUS_CHECK(false);
  }
  const std::string text = option.get_default_str();
  absl::string_view list = text;  // CLI11 prints several values as a list in brackets
  if (absl::ConsumePrefix(&list, "[") && absl::ConsumeSuffix(&list, "]")) return std::string(list);
  return text;
}

// Names of the options that are set by flags, and the path of the config file that a flag or the environment names.
struct Given {
  std::vector<std::string> flags;
  std::string file;
};

// Parses the flags only. Precondition: read_invocation() accepts `arguments`.
Given read_flags(const std::vector<std::string>& arguments, const Environment& environment) {
  ServerConfig ignored;
  Given given;
  CLI::App app;
  build_parser(app, ignored);
  app.set_config();  // a config file is not read
  app.add_option("--config", given.file);
  std::optional<Maintenance> ignored_command;
  add_maintenance(app, ignored_command);
  std::vector<std::string> reversed(arguments.rbegin(), arguments.rend());
  app.parse(std::move(reversed));
  for (const CLI::Option* option : static_cast<const CLI::App&>(app).get_options()) {
    if (option->get_lnames().empty() || !option->get_configurable()) continue;
    const std::string& name = option->get_lnames().front();
    if (option->count() > 0) given.flags.push_back(name);
  }
  if (given.file.empty()) given.file = environment(environment_variable("config")).value_or("");
  return given;
}

void find_origin(const Given& given, const Environment& environment, ConfigValue* value) {
  if (std::find(given.flags.begin(), given.flags.end(), value->name) != given.flags.end()) {
    value->origin = Origin::kFlag;
    value->place = absl::StrCat("--", value->name);
    return;
  }
  const std::string variable = environment_variable(value->name);
  const std::optional<std::string> set = environment(variable);
  if (set && (!set->empty() || may_be_empty(value->name))) {
    value->origin = Origin::kEnvironment;
    value->place = variable;
    return;
  }
  const std::string lines = given.file.empty() ? "" : lines_that_set(given.file, value->name);
  if (lines.empty()) return;
  value->origin = Origin::kFile;
  value->place = absl::StrCat(given.file, ":", lines);
}

}  // namespace

const char* origin_name(Origin origin) {
  switch (origin) {
    case Origin::kFlag:
      return "flag";
    case Origin::kEnvironment:
      return "environment";
    case Origin::kFile:
      return "file";
    case Origin::kDefault:
      return "default";
  }
  return "";
}

std::vector<ConfigValue> config_values(const std::vector<std::string>& arguments, const Environment& environment,
                                       const ServerConfig& config) {
  const Given given = read_flags(arguments, environment);
  ServerConfig used = config;
  CLI::App app;
  build_parser(app, used);
  std::vector<ConfigValue> values;
  for (const CLI::Option* option : static_cast<const CLI::App&>(app).get_options()) {
    if (option->get_lnames().empty() || !option->get_configurable()) continue;
    ConfigValue value;
    value.name = option->get_lnames().front();
    value.value = value_of(*option, used);
    find_origin(given, environment, &value);
    values.push_back(std::move(value));
  }
  return values;
}

absl::StatusOr<std::vector<ConfigValue>> config_origins(const std::vector<std::string>& arguments,
                                                        const Environment& environment) {
  const Invocation invocation = read_invocation(arguments, environment);
  if (!invocation.config) return absl::InvalidArgumentError(absl::StripTrailingAsciiWhitespace(invocation.text));
  return config_values(arguments, environment, *invocation.config);
}

std::string print_config(const std::vector<ConfigValue>& values, bool json) {
  if (json) {
    nlohmann::ordered_json all;
    nlohmann::ordered_json& options = all["options"] = nlohmann::ordered_json::array();
    for (const ConfigValue& value : values) {
      nlohmann::ordered_json& option = options.emplace_back();
      option["option"] = value.name;
      option["value"] = value.value;
      option["origin"] = origin_name(value.origin);
      option["place"] = value.place;
    }
    return all.dump() + "\n";
  }
  size_t name_width = 0, value_width = 0;
  for (const ConfigValue& value : values) {
    name_width = std::max(name_width, value.name.size());
    value_width = std::max(value_width, value.value.size());
  }
  const int names = static_cast<int>(name_width), in_use = static_cast<int>(value_width);
  std::string text = absl::StrFormat("%-*s  %-*s  %-11s  %s\n", names, "option", in_use, "value", "origin", "place");
  for (const ConfigValue& value : values)
    absl::StrAppendFormat(&text, "%-*s  %-*s  %-11s  %s\n", names, value.name, in_use, value.value,
                          origin_name(value.origin), value.place.empty() ? "-" : value.place);
  return text;
}

}  // namespace locus::server
