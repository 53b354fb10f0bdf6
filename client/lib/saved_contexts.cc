#include "client/lib/saved_contexts.h"

#include <algorithm>
#include <cstdlib>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "client/lib/pem_file.h"
#include "core/base/status_macros.h"

namespace locus::client {
namespace {

constexpr absl::string_view kDefaultKey = "default";
constexpr size_t kMaxContextName = 63;

struct ContextField {
  const char* name;
  std::string SavedContext::*value;
};
constexpr ContextField kContextFields[] = {
    {"address", &SavedContext::address},
    {"tls", &SavedContext::tls},
    {"ca", &SavedContext::ca},
    {"cert", &SavedContext::cert},
    {"key", &SavedContext::key},
    {"server_name", &SavedContext::server_name},
    {"token_file", &SavedContext::token_file},
    {"scene", &SavedContext::scene},
};

// Stores the option of one line `key = value` in `section`, or in `contexts` if the line is before the first section.
// Returns an error if the line is not valid.
absl::Status store_line(absl::string_view line, SavedContext* section, SavedContexts& contexts) {
  const std::pair<absl::string_view, absl::string_view> parts = absl::StrSplit(line, absl::MaxSplits('=', 1));
  const absl::string_view key = absl::StripAsciiWhitespace(parts.first);
  const std::string value(absl::StripAsciiWhitespace(parts.second));
  if (section == nullptr) {
    if (key != kDefaultKey) return absl::InvalidArgumentError("write `default = NAME` or `[NAME]` here");
    contexts.default_name = value;
    return absl::OkStatus();
  }
  if (key == "tls" && value != "true" && value != "false")
    return absl::InvalidArgumentError("tls is `true` or `false`");
  for (const ContextField& field : kContextFields) {
    if (key != field.name) continue;
    section->*field.value = value;
    return absl::OkStatus();
  }
  return absl::InvalidArgumentError("write `KEY = VALUE`: address, tls, ca, cert, key, server_name, token_file, scene");
}

}  // namespace

std::vector<std::pair<std::string, std::string>> fields_of(const SavedContext& context) {
  std::vector<std::pair<std::string, std::string>> fields;
  for (const ContextField& field : kContextFields) fields.emplace_back(field.name, context.*field.value);
  return fields;
}

std::string default_contexts_path() {
  const char* const config = std::getenv("XDG_CONFIG_HOME");
  if (config != nullptr && config[0] == '/') return absl::StrCat(config, "/locus/contexts");
  const char* const user = std::getenv("HOME");
  return user != nullptr && user[0] == '/' ? absl::StrCat(user, "/.config/locus/contexts") : "";
}

absl::Status check_context_name(absl::string_view name) {
  const bool legal =
      !name.empty() && name.size() <= kMaxContextName && std::all_of(name.begin(), name.end(), [](char c) {
        return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.';
      });
  return legal ? absl::OkStatus()
               : absl::InvalidArgumentError("the name of a context has 1 to 63 letters, digits, `-`, `_` and `.`");
}

absl::StatusOr<SavedContexts> parse_contexts(absl::string_view file, absl::string_view text) {
  SavedContexts contexts;
  SavedContext* section = nullptr;
  size_t number = 0;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    ++number;
    line = absl::StripAsciiWhitespace(line);
    if (line.empty() || line.front() == '#') continue;
    absl::Status stored;
    if (line.front() == '[' && line.back() == ']') {
      const absl::string_view name = line.substr(1, line.size() - 2);
      stored = check_context_name(name);
      if (stored.ok()) section = &contexts.by_name[std::string(name)];
    } else {
      stored = store_line(line, section, contexts);
    }
    if (!stored.ok()) return absl::InvalidArgumentError(absl::StrCat(file, ":", number, ": ", stored.message()));
  }
  return contexts;
}

std::string contexts_text(const SavedContexts& contexts) {
  std::string text;
  if (!contexts.default_name.empty()) absl::StrAppend(&text, kDefaultKey, " = ", contexts.default_name, "\n");
  for (const auto& [name, context] : contexts.by_name) {
    absl::StrAppend(&text, "[", name, "]\n");
    for (const auto& [key, value] : fields_of(context)) {
      if (!value.empty()) absl::StrAppend(&text, key, " = ", value, "\n");
    }
  }
  return text;
}

absl::StatusOr<SavedContexts> read_contexts(const std::string& path) {
  if (path.empty()) return SavedContexts();
  const absl::StatusOr<std::string> text = read_small_file("the contexts file", path, kMayBeEmpty);
  if (absl::IsNotFound(text.status())) return SavedContexts();
  RETURN_IF_ERROR(text.status());
  return parse_contexts(path, *text);
}

absl::StatusOr<SavedContext> find_context(const SavedContexts& contexts, const std::string& name) {
  const auto found = contexts.by_name.find(name);
  if (found != contexts.by_name.end()) return found->second;
  const std::string known = absl::StrJoin(
      contexts.by_name, ", ", [](std::string* out, const auto& entry) { absl::StrAppend(out, entry.first); });
  return absl::NotFoundError(absl::StrCat("there is no context ", name, "; there is ", known.empty() ? "none" : known,
                                          ": `locus context add NAME` makes one"));
}

}  // namespace locus::client
