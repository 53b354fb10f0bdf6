// Options that take one word of a few. Used in place of the parser's own checks, whose lists cannot be read back: what
// completes words, writes manual pages or explains a mistake asks choices_of() for the words.
#ifndef LOCUS_CLIENT_CLI_CHOICES_H_
#define LOCUS_CLIENT_CLI_CHOICES_H_

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// For Option::check(): only these words pass. The refusal names them all.
CLI::Validator choices(const std::vector<std::string>& words);

// For Option::transform() of an option that keeps an enum: each word with what it stands for.
template <class Enum>
using NamedValues = std::vector<std::pair<std::string, Enum>>;

// The word in place `i` of `words` is turned into the text in place `i` of `texts`.
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

// The words that choices() was given for this option, in that order; none for an option that takes anything.
std::vector<std::string> choices_of(CLI::Option& option);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_CHOICES_H_
