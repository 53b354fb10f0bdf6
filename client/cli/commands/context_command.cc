// `locus context`: manages contexts, which are the connection options of servers, stored under names. One context may
// be the default.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/connection_options.h"
#include "client/cli/output.h"
#include "client/cli/security/context_writer.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

using client::SavedContext;
using client::SavedContexts;

constexpr char kAdd[] = "add";
constexpr char kSet[] = "set";

struct ContextOptions {
  const CLI::App* program = nullptr;  // the parser with the options that stand before the command
  std::string verb = kSet;            // kSet or kAdd
  std::string name;
  SavedContext saved;
  bool tls = false;
};

Json context_row(const std::string& name, const SavedContexts& contexts, const SavedContext& saved) {
  Json row = {{"name", name}, {"default", name == contexts.default_name}};
  for (const auto& [key, value] : fields_of(saved)) row[key] = value.empty() ? Json() : Json(value);
  return row;
}

absl::Status list_contexts(const ContextOptions&, Context& context) {
  ASSIGN_OR_RETURN(const SavedContexts contexts, client::read_contexts(context.contexts_path()));
  Report report;
  report.rows_name = "contexts";
  report.no_rows = "no contexts";
  const Json columns = context_row("", {}, {});
  for (const auto& [key, value] : columns.items()) report.keys.push_back(key);
  for (const auto& [name, saved] : contexts.by_name) report.rows.push_back(context_row(name, contexts, saved));
  context.write(report);
  return absl::OkStatus();
}

absl::Status show_context(const ContextOptions& options, Context& context) {
  ASSIGN_OR_RETURN(const SavedContexts contexts, client::read_contexts(context.contexts_path()));
  const std::string& name = options.name.empty() ? contexts.default_name : options.name;
  if (name.empty()) return absl::NotFoundError("no context is the default: `locus context use NAME` chooses one");
  ASSIGN_OR_RETURN(const SavedContext saved, find_context(contexts, name));
  Report report;
  report.head = context_row(name, contexts, saved);
  context.write(report);
  return absl::OkStatus();
}

absl::Status use_context(const ContextOptions& options, Context& context) {
  ASSIGN_OR_RETURN(SavedContexts contexts, client::read_contexts(context.contexts_path()));
  RETURN_IF_ERROR(find_context(contexts, options.name).status());
  contexts.default_name = options.name;
  return write_contexts(context.contexts_path(), contexts);
}

// Makes the path of a file absolute, since a context can be used in any working directory.
void make_absolute(std::string& path) {
  std::error_code ignored;
  if (!path.empty()) path = std::filesystem::absolute(path, ignored).string();
}

// Returns an error if a connection option stands before the command, because `context set` and `context add` would not
// store its value. Values from environment variables are ignored: they apply to every command and are not meant to be
// stored.
absl::Status check_options_before(const CLI::App& program, const std::string& verb) {
  for (const std::string name : kConnectionOptionNames) {
    const CLI::Option& option = *program.get_option(name);
    if (option.count() == 0) continue;
    const char* const variable = std::getenv(option.get_envname().c_str());
    if (variable != nullptr && option.results().front() == variable) continue;
    if (name == "--context")
      return usage_error(absl::StrCat("`context ", verb, "` has no --context: the name follows `", verb, "`"));
    return usage_error(absl::StrCat(name, " before `context ", verb,
                                    "` would have no effect: give the options to keep after the name"));
  }
  return absl::OkStatus();
}

absl::Status set_context(const ContextOptions& options, Context& context) {
  RETURN_IF_ERROR(check_options_before(*options.program, options.verb));
  RETURN_IF_ERROR(client::check_context_name(options.name));
  ASSIGN_OR_RETURN(SavedContexts contexts, client::read_contexts(context.contexts_path()));
  if (options.verb == kAdd && contexts.by_name.contains(options.name))
    return absl::AlreadyExistsError(absl::StrCat("there is a context ", options.name,
                                                 " already: `locus context set` replaces it, `show` shows it"));
  SavedContext& saved = contexts.by_name[options.name];
  saved = options.saved;
  if (options.tls) saved.tls = "true";
  for (const auto& [key, value] : fields_of(saved)) {
    if (std::any_of(value.begin(), value.end(), [](unsigned char c) { return absl::ascii_iscntrl(c); }))
      return usage_error(absl::StrCat("the value of ", key, " has a control character"));
  }
  for (std::string* path : {&saved.ca, &saved.cert, &saved.key, &saved.token_file}) make_absolute(*path);
  return write_contexts(context.contexts_path(), contexts);
}

absl::Status remove_context(const ContextOptions& options, Context& context) {
  ASSIGN_OR_RETURN(SavedContexts contexts, client::read_contexts(context.contexts_path()));
  RETURN_IF_ERROR(find_context(contexts, options.name).status());
  contexts.by_name.erase(options.name);
  if (contexts.default_name == options.name) contexts.default_name.clear();
  return write_contexts(context.contexts_path(), contexts);
}

CLI::App& add_one(CLI::App& parent, const char* name, const char* description, const char* example) {
  CLI::App& command = *parent.add_subcommand(name, description);
  command.footer(absl::StrCat("Examples:\n  locus context ", example));
  return command;
}

// Adds the command `verb`, which stores a context: kAdd or kSet.
void add_storing(CLI::App& parent, Context& context, const char* verb, const char* description) {
  const auto options = std::make_shared<ContextOptions>();
  options->program = parent.get_parent();
  options->verb = verb;
  const std::string example =
      absl::StrCat(verb, " prod --address game.example.com:7575 --ca ca.pem --token-file game.token --scene arena");
  CLI::App& command = add_one(parent, verb, description, example.c_str());
  command.add_option("NAME", options->name, "Letters, digits, `-`, `_` and `.`, at most 63")->required();
  command.add_option("-a,--address", options->saved.address, "Where locusd listens")->type_name("ADDRESS");
  command.add_flag("--tls", options->tls, "Encrypt the connection; --ca, --cert and --server-name imply it");
  command.add_option("--ca", options->saved.ca, "Certificates of the server's authority")->type_name("FILE");
  command.add_option("--cert", options->saved.cert, "Certificate of this client")->type_name("FILE");
  command.add_option("--key", options->saved.key, "Private key of --cert")->type_name("FILE");
  command.add_option("--server-name", options->saved.server_name, "Name in the server's certificate")
      ->type_name("NAME");
  command.add_option("--token-file", options->saved.token_file, "File with the token; only its name is kept")
      ->type_name("FILE");
  command.add_option("--scene", options->saved.scene, "Scene of the commands that are given none; LOCUS_SCENE wins")
      ->type_name("SCENE");
  run_when_chosen(command, options, context, set_context);
}

}  // namespace

void add_context_command(CLI::App& parent, Context& context) {
  CLI::App& command = *parent.add_subcommand("context", "Keep the addresses and credentials of servers by name");
  command.footer(R"(Contexts are in ~/.config/locus/contexts. They name files with credentials and contain no secret.
An option on the line comes before its environment variable, and that before the context. The default context is used
only if the line names no context and neither the line nor LOCUS_ADDRESS gives an address, so that its credentials do not
reach another server.
Examples:
  locus context add prod --address game.example.com:7575 --ca ca.pem --token-file game.token --scene arena
  locus context use prod
  locus --context prod health)");
  command.require_subcommand(1);
  const auto options = std::make_shared<ContextOptions>();
  run_when_chosen(add_one(command, "list", "List the contexts", "list"), options, context, list_contexts);
  CLI::App& show = add_one(command, "show", "Show a context; never a token", "show prod");
  show.add_option("NAME", options->name, "The context [the default one]");
  run_when_chosen(show, options, context, show_context);
  CLI::App& use = add_one(command, "use", "Make a context the default", "use prod");
  use.add_option("NAME", options->name, "The context")->required();
  run_when_chosen(use, options, context, use_context);
  add_storing(command, context, kAdd, "Make a new context");
  add_storing(command, context, kSet, "Make a context, or replace one");
  CLI::App& remove = add_one(command, "remove", "Remove a context; its files stay", "remove prod");
  remove.add_option("NAME", options->name, "The context")->required();
  run_when_chosen(remove, options, context, remove_context);
}

}  // namespace locus::cli
