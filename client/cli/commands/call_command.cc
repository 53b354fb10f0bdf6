// `locus call`: calls any unary method of the server with a request in JSON.
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/strip.h"
#include "client/cli/commands.h"
#include "client/cli/failure.h"
#include "client/cli/rows/bulk/byte_input.h"
#include "client/lib/json_calls.h"
#include "client/lib/status.h"
#include "core/base/similar_word.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

using client::MethodInfo;

constexpr size_t kMaxRequestText = size_t{64} << 20;  // bytes of JSON

struct CallOptions {
  std::string method;
  std::string json = "{}";
  bool list = false;
};

// Returns the names under which a method may be called: locus.v1.SceneService/GetScene, SceneService/GetScene,
// GetScene.
std::vector<std::string> names_of(const MethodInfo& method) {
  const std::string service = method.service.substr(method.service.rfind('.') + 1);
  return {method.full_name(), absl::StrCat(service, "/", method.name), method.name};
}

// Returns the method with this name. Errors: a usage error if no method has it, if several have it, or if the method is
// a stream.
absl::StatusOr<MethodInfo> find_method(absl::string_view name) {
  absl::ConsumePrefix(&name, "/");
  std::vector<MethodInfo> found;
  std::vector<std::string> known;
  for (const MethodInfo& method : client::all_methods()) {
    for (const std::string& alias : names_of(method)) {
      if (alias == name) found.push_back(method);
      if (method.unary) known.push_back(alias);
    }
  }
  if (found.empty()) {
    const std::string similar = similar_word(name, known);
    return usage_error(absl::StrCat(
        "there is no method `", name, "`",
        similar.empty() ? "; `locus call --list` lists the methods" : absl::StrCat("; did you mean `", similar, "`?")));
  }
  if (found.size() > 1) {
    const auto full_name = [](std::string* out, const MethodInfo& method) { *out += method.full_name(); };
    return usage_error(absl::StrCat("`", name, "` names several methods: ", absl::StrJoin(found, ", ", full_name)));
  }
  if (!found.front().unary) {
    return usage_error(
        absl::StrCat("`", name, "` is a stream, and `locus call` makes only calls with one request and one reply"));
  }
  return found.front();
}

absl::Status list_methods(Context& context) {
  Report report;
  report.rows_name = "methods";
  report.keys = {"method", "request", "reply", "callable"};
  for (const MethodInfo& method : client::all_methods()) {
    report.rows.push_back({{"method", method.full_name()},
                           {"request", method.request},
                           {"reply", method.reply},
                           {"callable", method.unary}});
  }
  context.write(report);
  return absl::OkStatus();
}

// Returns the text of the request; "-" reads it from the standard input.
absl::StatusOr<std::string> request_text(const std::string& json) {
  if (json != "-") return json;
  ASSIGN_OR_RETURN(ByteInput input, ByteInput::open(json));
  constexpr size_t kPiece = size_t{64} << 10;
  std::string text;
  while (text.size() <= kMaxRequestText) {
    const size_t had = text.size();
    text.resize(had + kPiece);
    ASSIGN_OR_RETURN(const size_t count, input.read(absl::MakeSpan(text).subspan(had)));
    text.resize(had + count);
    if (count == 0) return text;
  }
  return absl::InvalidArgumentError(absl::StrCat("the request is longer than ", kMaxRequestText, " bytes"));
}

absl::Status call(const CallOptions& options, Context& context) {
  if (options.list) {
    if (!options.method.empty()) return usage_error("--list calls nothing: leave METHOD out");
    return list_methods(context);
  }
  if (options.method.empty()) return usage_error("give a METHOD, or --list");
  ASSIGN_OR_RETURN(const MethodInfo method, find_method(options.method));
  ASSIGN_OR_RETURN(client::Client* const client, context.connect());
  ASSIGN_OR_RETURN(const std::string text, request_text(options.json));
  const absl::StatusOr<std::string> reply = client::call_json(*client, method, text);
  const bool is_bad_json = absl::IsInvalidArgument(reply.status()) && !client::refused_by_server(reply.status());
  if (is_bad_json) return usage_error(reply.status().message());
  RETURN_IF_ERROR(reply.status());
  context.out() << *reply << '\n';
  return absl::OkStatus();
}

}  // namespace

void add_call_command(CLI::App& parent, Context& context) {
  const auto options = std::make_shared<CallOptions>();
  CLI::App& command =
      *parent.add_subcommand("call", "Call any method of the server with a request in JSON, and print its reply");
  command.footer(
      R"(The JSON is that of protobuf: ids of 64 bits are strings, and bytes are base64. A short name of a method is enough.
Examples:
  locus call --list
  locus call GetServer
  locus call GetScene '{"name": "arena"}'
  locus call locus.v1.UpdateService/ApplyUpdates '{"scene": "arena", "batch": {"removeIds": ["7"]}}'
  locus call Query - < query.json
  locus call Step '{"scene": "arena", "update": {"removeIds": ["7"]}, "queries": {"blocks": [{"lookup": {"ids": ["7"]}}]}}')");
  command.add_option("METHOD", options->method, "The method, such as GetScene or locus.v1.SceneService/GetScene");
  command.add_option("JSON", options->json, "The request; - is standard input [{}]");
  command.add_flag("--list", options->list, "List the methods");
  run_when_chosen(command, options, context, call);
}

}  // namespace locus::cli
