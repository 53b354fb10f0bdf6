#include "client/cli/choices.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "core/base/similar_word.h"

namespace locus::cli {
namespace {

// Prefix of the name of the validator that choices() returns. In this name the prefix is followed by the allowed words,
// so that choices_of() can read the words from the name. CLI11 never prints the name.
constexpr char kName[] = "choices:";

}  // namespace

CLI::Validator translated_choices(const std::vector<std::string>& words, const std::vector<std::string>& texts) {
  const auto translate = [words, texts](std::string& text) -> std::string {
    const auto found = std::find(words.begin(), words.end(), text);
    if (found == words.end()) {
      const std::string similar = similar_word(text, words);
      return absl::StrCat("'", text, "' is none of ", absl::StrJoin(words, ", "),
                          similar.empty() ? "" : absl::StrCat("; did you mean '", similar, "'?"));
    }
    text = texts[static_cast<size_t>(found - words.begin())];
    return "";
  };
  return CLI::Validator(translate, "", absl::StrCat(kName, absl::StrJoin(words, "|")));
}

CLI::Validator choices(const std::vector<std::string>& words) { return translated_choices(words, words); }

std::vector<std::string> choices_of(CLI::Option& option) {
  for (int i = 0;; ++i) {
    const CLI::Validator* validator = nullptr;
    try {  // CLI11 throws OptionNotFound if `i` is beyond the last validator
      validator = option.get_validator(i);
    } catch (const CLI::OptionNotFound&) {
      return {};
    }
    absl::string_view name = validator->get_name();
    if (absl::ConsumePrefix(&name, kName)) return absl::StrSplit(name, '|');
  }
}

}  // namespace locus::cli
