#include "server/config/config_file.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "core/base/similar_word.h"

namespace locus::server {
namespace {

// Returns the name of the first item that sets no option of the file; empty if all items set one. A section in brackets
// is such an item, because the file has no sections.
std::string unknown_item(const std::vector<CLI::ConfigItem>& items, const std::vector<std::string>& names) {
  for (const CLI::ConfigItem& item : items) {
    if (!item.parents.empty() && item.name == "++") return absl::StrCat("[", item.parents.back(), "]");
    if (std::find(names.begin(), names.end(), item.fullname()) == names.end()) return item.fullname();
  }
  return "";
}

// Returns the message for the first line of the file that sets no option of the file; empty if all lines set one. Reads
// the file line by line as CLI11 does, so that values on several lines are understood.
std::string unknown_line(const CLI::App& app, const std::string& path) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    if (option->get_configurable())
      for (const std::string& name : option->get_lnames()) names.push_back(name);
  std::ifstream file(path);
  std::string line, text;
  for (int number = 1; std::getline(file, line); ++number) {
    absl::StrAppend(&text, line, "\n");
    std::istringstream lines(text);
    const std::string unknown = unknown_item(app.get_config_formatter()->from_config(lines), names);
    if (unknown.empty()) continue;
    const std::string similar = similar_word(unknown, names);
    return absl::StrCat(path, ":", number, ": there is no option `", unknown, "` of the file",
                        similar.empty() ? "" : absl::StrCat("; did you mean `", similar, "`?"));
  }
  return "";
}

}  // namespace

std::string lines_that_set(const std::string& path, const std::string& name) {
  std::ifstream file(path);
  std::string lines;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const absl::string_view key = absl::string_view(line).substr(0, line.find('='));
    if (absl::StripAsciiWhitespace(key) == name) absl::StrAppend(&lines, lines.empty() ? "" : ",", number);
  }
  return lines;
}

std::string with_line_of_file(const CLI::App& app, const std::vector<std::string>& arguments, const CLI::Error& error) {
  const std::string message = error.what();
  const CLI::Option* file = app.get_config_ptr();
  if (file == nullptr || file->count() == 0) return message;
  const auto path = file->as<std::string>();
  std::error_code why;
  if (!std::filesystem::is_regular_file(path, why)) return message;  // a pipe cannot be read a second time
  if (dynamic_cast<const CLI::ConfigError*>(&error) != nullptr) {
    const std::string unknown = unknown_line(app, path);
    return unknown.empty() ? message : unknown;
  }
  // Other messages begin with the option, whose value is that of the file unless an argument sets it.
  const std::string flag = message.substr(0, message.find(':'));
  if (!absl::StartsWith(flag, "--")) return message;
  for (const std::string& argument : arguments)
    if (argument == flag || absl::StartsWith(argument, flag + "=")) return message;
  const std::string lines = lines_that_set(path, flag.substr(2));
  return lines.empty() ? message : absl::StrCat(path, ":", lines, ": ", message);
}

}  // namespace locus::server
