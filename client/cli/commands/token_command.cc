// `locus token`: bearer tokens in the token file of locusd. Runs on the server's machine; the server need not be
// running.
#include <memory>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/cli/commands.h"
#include "client/cli/output.h"
#include "client/cli/security/token_writer.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct TokenOptions {
  std::string id;
  std::string file;
  std::string expires = "never";
  std::string comment;
};

absl::Status create_one_token(const TokenOptions& options, Context& context) {
  std::optional<absl::Duration> lifetime;
  if (options.expires != "never") {
    const absl::StatusOr<absl::Duration> parsed = parse_lifetime(options.expires);
    if (!parsed.ok()) return usage_error(absl::StrCat("--expires: ", parsed.status().message()));
    lifetime = *parsed;
  }
  ASSIGN_OR_RETURN(const std::string token,
                   create_token(options.file, options.id, absl::Now(), lifetime, options.comment));
  context.out() << token << '\n';
  context.err() << "added " << options.id << " to " << options.file << "; the token is shown only this once\n";
  return absl::OkStatus();
}

absl::Status list_token_file(const TokenOptions& options, Context& context) {
  ASSIGN_OR_RETURN(const std::vector<TokenLine> lines, list_tokens(options.file, absl::Now()));
  Report report;
  report.rows_name = "tokens";
  report.no_rows = "no tokens";
  report.keys = {"id", "created", "expires", "expired", "comment"};
  for (const TokenLine& line : lines) {
    report.rows.push_back({{"id", line.id},
                           {"created", line.created},
                           {"expires", line.expires},
                           {"expired", line.expired},
                           {"comment", line.comment}});
  }
  context.write(report);
  return absl::OkStatus();
}

absl::Status revoke_one_token(const TokenOptions& options, Context& context) {
  RETURN_IF_ERROR(revoke_token(options.file, options.id));
  context.err() << "removed " << options.id << " from " << options.file
                << "; locusd refuses it once it reads the file\n";
  return absl::OkStatus();
}

CLI::App& add_token_action(CLI::App& parent, const char* name, const char* description, const char* example,
                           TokenOptions& options) {
  CLI::App& command = *parent.add_subcommand(name, description);
  command.footer(absl::StrCat("Examples:\n  locus token ", example));
  command.add_option("--token-file", options.file, "The token file of locusd")->type_name("FILE")->required();
  return command;
}

}  // namespace

void add_token_command(CLI::App& parent, Context& context) {
  CLI::App& command = *parent.add_subcommand("token", "Make, list and revoke tokens in a token file of locusd");
  command.footer(R"(A token file has a line for each token, with the token's SHA-256 and not the token itself.
Examples:
  locus token create lobby --token-file tokens --expires 30d > lobby.token
  locus token list --token-file tokens
  locus token revoke lobby --token-file tokens)");
  command.require_subcommand(1);
  const auto options = std::make_shared<TokenOptions>();
  CLI::App& create = add_token_action(command, "create", "Make a token and print it, once",
                                      "create lobby --token-file tokens --expires 30d > lobby.token", *options);
  create.add_option("ID", options->id, "Name of the token: lower case letters, digits and dashes, at most 63")
      ->required();
  create.add_option("--expires", options->expires, "Lifetime, such as 12h, 30d or 8w")
      ->type_name("TIME")
      ->capture_default_str();
  create.add_option("--comment", options->comment, "Comment, stored in the file")->type_name("TEXT");
  run_when_chosen(create, options, context, create_one_token);
  CLI::App& list = add_token_action(command, "list", "List the tokens of a file, without any secret",
                                    "list --token-file tokens", *options);
  run_when_chosen(list, options, context, list_token_file);
  CLI::App& revoke =
      add_token_action(command, "revoke", "Remove a token from a file", "revoke lobby --token-file tokens", *options);
  revoke.add_option("ID", options->id, "Name of the token")->required();
  run_when_chosen(revoke, options, context, revoke_one_token);
}

}  // namespace locus::cli
