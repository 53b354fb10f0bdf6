#include <memory>
#include <string>

#include "client/cli/commands.h"
#include "client/cli/output.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

struct QuotaOptions {
  std::string identity;
  bool all = false;
};

// Returns `value` as a JSON integer if it is an integer between -2^53 and 2^53, so that amounts are printed without a
// decimal point. Returns any other value as a double.
Json amount_json(double value) {
  constexpr double kExactIntegers = 9007199254740992.0;
  if (!(value > -kExactIntegers && value < kExactIntegers)) return value;
  const auto integer = static_cast<int64_t>(value);
  return static_cast<double>(integer) == value ? Json(integer) : Json(value);
}

absl::Status quota(const QuotaOptions& options, Context& context) {
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  v1::GetQuotasRequest request;
  request.set_identity(options.identity);
  request.set_all(options.all);
  ASSIGN_OR_RETURN(const std::vector<v1::IdentityQuotas> entries, client->get_quotas(request));
  Report report;
  report.rows_name = "quotas";
  report.keys = {"identity", "quota", "limit", "used", "available"};
  for (const v1::IdentityQuotas& entry : entries)
    for (const v1::QuotaUse& use : entry.quotas())
      report.rows.push_back({{"identity", entry.identity()},
                             {"quota", use.name()},
                             {"limit", use.has_limit() ? amount_json(use.limit()) : Json()},
                             {"used", amount_json(use.used())},
                             {"available", use.has_available() ? amount_json(use.available()) : Json()}});
  context.write(report);
  return absl::OkStatus();
}

}  // namespace

void add_quota_command(CLI::App& parent, Context& context) {
  CLI::App& command =
      *parent.add_subcommand("quota", "Show the quotas of a caller, and how much is in use; - means unlimited");
  const auto options = std::make_shared<QuotaOptions>();
  CLI::Option* const identity =
      command.add_option("--identity", options->identity, "Of this identity, such as token:ci, instead of yours")
          ->type_name("IDENTITY");
  command.add_flag("--all", options->all, "Of all identities and connections that use or created something")
      ->excludes(identity);
  command.footer(
      "--identity and --all need the right `admin *`.\n"
      "Examples:\n  locus quota\n  locus quota --identity token:ci\n  locus -o csv quota --all");
  run_when_chosen(command, options, context, quota);
}

}  // namespace locus::cli
