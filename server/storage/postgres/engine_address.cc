#include "server/storage/postgres/engine_address.h"

#include <libpq-fe.h>

#include <memory>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/base/refusal.h"

namespace locus::server {
namespace {

constexpr absl::string_view kExample = "postgresql://locus@host1,host2,host3/locus";

absl::Status refuse_url(absl::string_view why) {
  return refuse_argument(Reason::kMalformed, "cluster", std::nullopt,
                         absl::StrCat(why, "; write an address such as ", kExample));
}

}  // namespace

absl::StatusOr<EngineAddress> EngineAddress::parse(absl::string_view url) {
  if (!absl::StartsWith(url, "postgresql://") && !absl::StartsWith(url, "postgres://"))
    return refuse_url("the address of the engine must begin with postgresql://");
  char* error = nullptr;
  const std::unique_ptr<PQconninfoOption, decltype(&PQconninfoFree)> parsed(
      PQconninfoParse(std::string(url).c_str(), &error), &PQconninfoFree);
  const std::unique_ptr<char, decltype(&PQfreemem)> owned_error(error, &PQfreemem);
  // libpq's message quotes the address, which might contain a password.
  if (parsed == nullptr) return refuse_url("libpq cannot parse the address of the engine");
  EngineAddress address;
  std::vector<std::string> names, ports;
  for (const PQconninfoOption* option = parsed.get(); option->keyword != nullptr; ++option) {
    if (option->val == nullptr) continue;
    const absl::string_view keyword = option->keyword;
    if (keyword == "password")
      return refuse_url("the address of the engine contains a password: store it in a password file (PGPASSFILE)");
    if (keyword == "hostaddr")
      return refuse_url("the address of the engine has the setting hostaddr: write the address as host");
    if (keyword == "host") {
      names = absl::StrSplit(option->val, ',');
    } else if (keyword == "port") {
      ports = absl::StrSplit(option->val, ',');
    } else if (keyword != "target_session_attrs") {
      address.shared_.emplace_back(keyword, option->val);
    }
  }
  if (names.empty()) names.emplace_back();  // libpq's default: the local socket
  if (ports.size() > 1 && ports.size() != names.size())
    return refuse_url(absl::StrCat("the address of the engine has ", names.size(), " hosts and ", ports.size(),
                                   " ports: name no port, one port, or one for each host"));
  for (size_t i = 0; i < names.size(); ++i)
    address.hosts_.push_back({names[i], ports.empty() ? "" : ports[ports.size() == 1 ? 0 : i]});
  return address;
}

std::string EngineAddress::host_name(size_t host) const {
  const Host& found = hosts_[host];
  return absl::StrCat(found.name.empty() ? "localhost" : found.name, ":", found.port.empty() ? "5432" : found.port);
}

EngineAddress::Settings EngineAddress::settings_of(size_t host) const {
  Settings settings = shared_;
  if (!hosts_[host].name.empty()) settings.emplace_back("host", hosts_[host].name);
  if (!hosts_[host].port.empty()) settings.emplace_back("port", hosts_[host].port);
  settings.emplace_back("target_session_attrs", "read-write");  // a standby is refused: its data may be older
  settings.emplace_back("client_encoding", "UTF8");
  settings.emplace_back("fallback_application_name", "locusd");
  return settings;
}

}  // namespace locus::server
