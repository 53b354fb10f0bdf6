#include "client/cli/mistakes.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/strings/strip.h"
#include "core/base/similar_word.h"

namespace locus::cli {
namespace {

// Longest part of a wrong word that a message quotes, in bytes.
constexpr size_t kMaxQuoted = 60;

std::string in_quotes(absl::string_view word) { return absl::StrCat("`", word.substr(0, kMaxQuoted), "`"); }

// Returns "; did you mean `word`?" or, without a similar word, `otherwise`.
std::string suggestion(absl::string_view word, const std::vector<std::string>& candidates,
                       const std::string& otherwise) {
  const std::string similar = similar_word(word, candidates);
  return similar.empty() ? otherwise : absl::StrCat("; did you mean ", in_quotes(similar), "?");
}

bool is_option(const std::string& argument) {
  double number = 0;
  return argument.size() > 1 && argument.front() == '-' &&
         !absl::SimpleAtod(argument.substr(0, argument.find(',')), &number);
}

// Reads a line word by word, as the parser does, up to the first word that the parser does not know.
class LineReader {
 public:
  explicit LineReader(const CLI::App& app) : path_({&app}) {}

  // Returns the message for the first unknown word; nullopt if all words are known.
  std::optional<std::string> read(const std::vector<std::string>& arguments) {
    for (size_t i = 0; i < arguments.size(); ++i) {
      const std::string& argument = arguments[i];
      if (argument == "--") return std::nullopt;
      if (is_option(argument)) {
        const CLI::Option* const option = find_option(argument);
        if (option == nullptr) return no_option(argument);
        if (!absl::StrContains(argument, '=')) i += values_after(*option, arguments, i);
      } else if (const CLI::App* const child = find_command(argument)) {
        path_.push_back(child);
      } else if (positionals_ == most_positionals()) {
        return unexpected(argument);
      } else {
        ++positionals_;
      }
    }
    return std::nullopt;
  }

  // Returns the option that `argument` names; null if neither the command nor the commands around it have it.
  const CLI::Option* find_option(const std::string& argument) const {
    const bool is_long = absl::StartsWith(argument, "--");
    const std::string name = is_long ? argument.substr(0, argument.find('=')) : argument.substr(0, 2);
    for (auto app = path_.rbegin(); app != path_.rend(); ++app)
      if (const CLI::Option* const option = (*app)->get_option_no_throw(name)) return option;
    return nullptr;
  }

  std::string command() const {
    return absl::StrJoin(path_, " ", [](std::string* out, const CLI::App* app) { *out += app->get_name(); });
  }

  std::vector<std::string> commands() const {
    std::vector<std::string> names;
    for (const CLI::App* child : path_.back()->get_subcommands({}))
      if (!child->get_group().empty()) names.push_back(child->get_name());
    return names;
  }

 private:
  const CLI::App* find_command(const std::string& word) const {
    for (const CLI::App* child : path_.back()->get_subcommands({}))
      if (child->get_name() == word) return child;
    return nullptr;
  }

  // Returns the number of arguments after `i` that are values of `option`.
  static size_t values_after(const CLI::Option& option, const std::vector<std::string>& arguments, size_t i) {
    const bool is_short = arguments[i].size() > 2 && arguments[i][1] != '-';  // as -ojson
    if (is_short || option.get_items_expected_max() == 0) return 0;
    const size_t most = option.get_allow_extra_args() ? static_cast<size_t>(option.get_items_expected_max()) : 1;
    size_t values = 1;
    while (values < most && i + values + 1 < arguments.size() && !is_option(arguments[i + values + 1])) ++values;
    return values;
  }

  size_t most_positionals() const {
    size_t most = 0;
    for (const CLI::Option* option : path_.back()->get_options())
      if (option->get_positional()) most += static_cast<size_t>(option->get_items_expected_max());
    return most;
  }

  std::string no_option(const std::string& argument) const {
    std::vector<std::string> names;
    for (auto app = path_.rbegin(); app != path_.rend(); ++app)
      for (const CLI::Option* option : (*app)->get_options())
        if (!option->get_group().empty())
          for (const std::string& name : option->get_lnames()) names.push_back(absl::StrCat("--", name));
    const std::string name = argument.substr(0, argument.find('='));
    return absl::StrCat(in_quotes(command()), " has no option ", in_quotes(name), suggestion(name, names, ""));
  }

  std::string unexpected(const std::string& argument) const {
    const std::vector<std::string> names = commands();
    if (names.empty())
      return absl::StrCat(in_quotes(argument), " is unexpected: ", in_quotes(command()), " takes ", most_positionals(),
                          most_positionals() == 1 ? " word" : " words", " besides its options");
    return absl::StrCat(in_quotes(command()), " has no command ", in_quotes(argument),
                        suggestion(argument, names, absl::StrCat("; its commands are ", absl::StrJoin(names, ", "))));
  }

  std::vector<const CLI::App*> path_;  // the program, its command, the command's command
  size_t positionals_ = 0;
};

// Returns a message for a value that the parser cannot convert, with the name of the value in the help, which shows its
// form. `message` is the parser's own: "Could not convert: --size = 640".
std::string in_words(const LineReader& reader, absl::string_view message) {
  absl::string_view rest = message;
  if (!absl::ConsumePrefix(&rest, "Could not convert: ")) return std::string(message);
  const std::pair<absl::string_view, absl::string_view> parts = absl::StrSplit(rest, absl::MaxSplits(" = ", 1));
  const CLI::Option* const option = reader.find_option(std::string(parts.first));
  if (option == nullptr) return std::string(message);
  int64_t number = 0;
  const bool negative = absl::SimpleAtoi(parts.second, &number) && number < 0;
  return absl::StrCat(parts.first, " ", option->get_type_name(), ": cannot read '", parts.second.substr(0, kMaxQuoted),
                      negative ? "': it cannot be negative" : "'");
}

}  // namespace

Mistake mistake_in(const CLI::App& app, const std::vector<std::string>& arguments, const CLI::ParseError& error) {
  LineReader reader(app);
  const std::optional<std::string> unknown = reader.read(arguments);
  const bool is_about_words = dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr ||
                              dynamic_cast<const CLI::RequiredError*>(&error) != nullptr;
  if (unknown && is_about_words) return {*unknown, reader.command()};
  const std::vector<std::string> commands = reader.commands();
  if (dynamic_cast<const CLI::RequiredError*>(&error) != nullptr && !commands.empty())
    return {absl::StrCat(in_quotes(reader.command()), " needs a command: ", absl::StrJoin(commands, ", ")),
            reader.command()};
  std::string message = error.what();
  if (dynamic_cast<const CLI::ConversionError*>(&error) != nullptr) message = in_words(reader, message);
  return {message, reader.command()};
}

}  // namespace locus::cli
