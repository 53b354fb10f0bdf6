// Options that accept only a few words. CLI11's own checks do not let a program read the allowed words, but shell
// completion, manual pages and error messages need them. Therefore these options use choices(), and choices_of()
// returns the words.
#ifndef LOCUS_CLIENT_CLI_CHOICES_H_
#define LOCUS_CLIENT_CLI_CHOICES_H_

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// Returns a validator for Option::check() that accepts only these words. Its error message lists all the words.
CLI::Validator choices(const std::vector<std::string>& words);

// Allowed words, each paired with its enum value. For Option::transform() of an option that stores an enum.
template <class Enum>
using NamedValues = std::vector<std::pair<std::string, Enum>>;

// Returns a validator for Option::transform() that replaces `words[i]` by `texts[i]` and refuses other words.
CLI::Validator translated_choices(const std::vector<std::string>& words, const std::vector<std::string>& texts);

template <class Enum>
CLI::Validator choices(const NamedValues<Enum>& values) {
  std::vector<std::string> words;
  std::vector<std::string> texts;
  for (const auto& [word, value] : values) {
    words.push_back(word);
    texts.push_back(std::to_string(static_cast<std::underlying_type_t<Enum>>(value)));
  }
  return translated_choices(words, texts);
}

// Returns the words that were passed to choices() for this option, in that order; empty if the option accepts any
// value.
std::vector<std::string> choices_of(CLI::Option& option);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_CHOICES_H_
