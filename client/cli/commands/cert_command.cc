// `locus cert`: an authority for development, and certificates for locusd and its clients. Needs no server.
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/arguments.h"
#include "client/cli/commands.h"
#include "client/cli/output.h"
#include "client/cli/security/certificates.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr int kAuthorityDays = 825;
constexpr int kLeafDays = 90;
constexpr int kMaxDays = 36500;

struct CertOptions {
  std::string folder;
  std::vector<std::string> names;
  std::vector<std::string> addresses;
  std::string client_name;
  int days = kLeafDays;
};

std::string in_folder(const CertOptions& options, absl::string_view name) {
  return absl::StrCat(options.folder, "/", name);
}

// Writes the report. It contains the path of the certificate (BASE.pem), the path of the private key (BASE.key), and
// the text `next` under the name `use`. This text is an example of a command that uses these two files.
void write_made(Context& context, const std::string& base, const std::string& use, const std::string& next) {
  Report report;
  report.head = {{"certificate", absl::StrCat(base, ".pem")}, {"key", absl::StrCat(base, ".key")}, {use, next}};
  context.write(report);
}

absl::Status make_authority(const CertOptions& options, Context& context) {
  std::error_code ignored;  // write_certificate() reports a missing folder
  std::filesystem::create_directories(options.folder, ignored);
  ASSIGN_OR_RETURN(
      const CertificatePair made,
      make_certificate(
          {.use = CertificateUse::kAuthority, .common_name = "locus development authority", .days = options.days}, {}));
  RETURN_IF_ERROR(write_certificate(in_folder(options, "ca"), made));
  write_made(context, in_folder(options, "ca"), "next",
             absl::StrCat("locus cert server ", options.folder, " --name localhost --address 127.0.0.1"));
  return absl::OkStatus();
}

absl::Status make_server(const CertOptions& options, Context& context) {
  if (options.names.empty() && options.addresses.empty())
    return usage_error("a server's certificate needs --name HOST or --address IP, as clients will write it");
  ASSIGN_OR_RETURN(const CertificatePair authority, read_certificate(in_folder(options, "ca")));
  const std::string& name = options.names.empty() ? options.addresses.front() : options.names.front();
  ASSIGN_OR_RETURN(const CertificatePair made, make_certificate({.use = CertificateUse::kServer,
                                                                 .common_name = name,
                                                                 .dns_names = options.names,
                                                                 .addresses = options.addresses,
                                                                 .days = options.days},
                                                                authority));
  const std::string base = in_folder(options, "server");
  RETURN_IF_ERROR(write_certificate(base, made));
  write_made(context, base, "start",
             absl::StrCat("locusd --tls-cert ", base, ".pem --tls-key ", base, ".key --tls-client-ca ",
                          in_folder(options, "ca.pem")));
  return absl::OkStatus();
}

absl::Status make_client(const CertOptions& options, Context& context) {
  const std::string& name = options.client_name;
  if (name.empty() || name.find('/') != std::string::npos || name.front() == '.' || name == "ca" || name == "server")
    return usage_error("--name becomes the name of the files: no `/`, no `.` first, and neither ca nor server");
  ASSIGN_OR_RETURN(const CertificatePair authority, read_certificate(in_folder(options, "ca")));
  ASSIGN_OR_RETURN(
      const CertificatePair made,
      make_certificate({.use = CertificateUse::kClient, .common_name = name, .days = options.days}, authority));
  const std::string base = in_folder(options, name);
  RETURN_IF_ERROR(write_certificate(base, made));
  write_made(
      context, base, "connect",
      absl::StrCat("locus --ca ", in_folder(options, "ca.pem"), " --cert ", base, ".pem --key ", base, ".key health"));
  return absl::OkStatus();
}

CLI::App& add_cert_kind(CLI::App& parent, const char* name, const char* description, const char* example, int days,
                        const std::shared_ptr<CertOptions>& options) {
  CLI::App& command = *parent.add_subcommand(name, description);
  command.footer(absl::StrCat("Examples:\n  locus cert ", example));
  options->days = days;
  command.add_option("DIRECTORY", options->folder, "Folder of the authority")->required();
  command.add_option("--days", options->days, "Days for which the certificate is valid")
      ->type_name("DAYS")
      ->check(CLI::Range(1, kMaxDays))
      ->capture_default_str();
  return command;
}

}  // namespace

void add_cert_command(CLI::App& parent, Context& context) {
  CLI::App& command = *parent.add_subcommand("cert", "Make certificates for development, and their authority");
  command.footer(R"(Files that exist are never overwritten. Keys can be read only by their owner.
Examples:
  locus cert authority certs
  locus cert server certs --name game.example.com --address 127.0.0.1
  locus cert client certs --name lobby)");
  command.require_subcommand(1);
  const auto authority_options = std::make_shared<CertOptions>();
  CLI::App& authority = add_cert_kind(command, "authority", "Make an authority: ca.pem and ca.key", "authority certs",
                                      kAuthorityDays, authority_options);
  run_when_chosen(authority, authority_options, context, make_authority);
  const auto server_options = std::make_shared<CertOptions>();
  CLI::App& server = add_cert_kind(command, "server", "Make a certificate for locusd: server.pem and server.key",
                                   "server certs --name localhost --address 127.0.0.1", kLeafDays, server_options);
  add_repeatable(server, "--name", server_options->names, "HOST", "A name that clients use as address");
  add_repeatable(server, "--address", server_options->addresses, "IP", "An IP address that clients use");
  run_when_chosen(server, server_options, context, make_server);
  const auto client_options = std::make_shared<CertOptions>();
  CLI::App& client = add_cert_kind(command, "client", "Make a certificate for a client: NAME.pem and NAME.key",
                                   "client certs --name lobby", kLeafDays, client_options);
  client.add_option("--name", client_options->client_name, "The client's name for the server")
      ->type_name("NAME")
      ->required();
  run_when_chosen(client, client_options, context, make_client);
}

}  // namespace locus::cli
