#include "tests/bench/serving/certificates.h"

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "tests/bench/serving/process.h"

namespace locus::bench::serving {
namespace {

constexpr double kCertSeconds = 20;  // maximum time of one command
constexpr const char* kClientName = "guest";

}  // namespace

absl::StatusOr<std::unique_ptr<Certificates>> Certificates::make() {
  auto made = std::unique_ptr<Certificates>(new Certificates());
  const std::string folder = made->folder_.file("");
  RETURN_IF_ERROR(made->run_cert({"authority", folder}));
  RETURN_IF_ERROR(made->run_cert({"server", folder, "--address", "127.0.0.1"}));
  RETURN_IF_ERROR(made->run_cert({"client", folder, "--name", kClientName}));
  return made;
}

std::vector<std::string> Certificates::daemon_options(Transport transport) const {
  if (transport == Transport::kPlain) return {};
  std::vector<std::string> options = {absl::StrCat("--tls-cert=", folder_.file("server.pem")),
                                      absl::StrCat("--tls-key=", folder_.file("server.key"))};
  if (transport == Transport::kMutualTls) options.push_back(absl::StrCat("--tls-client-ca=", folder_.file("ca.pem")));
  return options;
}

client::CredentialOptions Certificates::client_options(Transport transport) const {
  client::CredentialOptions options;
  if (transport != Transport::kPlain) options.ca_file = folder_.file("ca.pem");
  if (transport == Transport::kMutualTls) {
    options.certificate_file = folder_.file(absl::StrCat(kClientName, ".pem"));
    options.key_file = folder_.file(absl::StrCat(kClientName, ".key"));
  }
  return options;
}

absl::Status Certificates::run_cert(std::vector<std::string> words) const {
  const std::string program = program_beside("locus"), log = folder_.file("log");
  if (program.empty()) return absl::UnavailableError("there is no locus beside this program; build it too");
  words.insert(words.begin(), {"locus", "cert"});
  ASSIGN_OR_RETURN(const std::unique_ptr<Process> process, Process::start(program, words, log));
  constexpr double kLook = 0.005;
  for (double waited = 0; waited < kCertSeconds && !process->has_ended(); waited += kLook) sleep_seconds(kLook);
  if (process->exit_code() != 0) return absl::UnavailableError(absl::StrCat("locus cert failed: ", text_of_file(log)));
  return absl::OkStatus();
}

}  // namespace locus::bench::serving
