#include "client/cli/shell/completer.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace locus::cli {
namespace {

// One line of the table: command, option or positional argument.
struct Candidate {
  std::string kind;
  std::string word;
  std::vector<std::string> value;  // kind of value, and the words of `choice` and `list`
};

std::vector<Candidate> candidates_of(const std::vector<TableEntry>& table, const std::string& path) {
  std::vector<Candidate> candidates;
  const auto entry =
      std::find_if(table.begin(), table.end(), [&](const TableEntry& found) { return found.path == path; });
  if (entry == table.end()) return candidates;
  for (const std::string& line : entry->lines) {
    const std::vector<std::string> parts = absl::StrSplit(line, '\t');
    candidates.push_back({parts[0], parts[1], absl::StrSplit(parts[2], ' ')});
  }
  return candidates;
}

const Candidate* find(const std::vector<Candidate>& candidates, absl::string_view kind, absl::string_view word) {
  const auto found = std::find_if(candidates.begin(), candidates.end(), [&](const Candidate& candidate) {
    return candidate.kind == kind && candidate.word == word;
  });
  return found == candidates.end() ? nullptr : &*found;
}

// Returns the words that a value may be.
std::vector<std::string> words_of_value(const Candidate& candidate, const SceneNames& scenes) {
  if (candidate.value.front() == "scene") return scenes();
  return {candidate.value.begin() + 1, candidate.value.end()};
}

}  // namespace

std::vector<std::string> complete(const std::vector<TableEntry>& table, absl::string_view line,
                                  const SceneNames& scenes) {
  std::vector<std::string> words = absl::StrSplit(line, ' ', absl::SkipEmpty());
  std::string last;
  if (!words.empty() && !absl::EndsWith(line, " ")) {
    last = words.back();
    words.pop_back();
  }
  std::string path = "locus";
  std::vector<Candidate> candidates = candidates_of(table, path);
  size_t arguments = 0;               // positional arguments before the last word
  const Candidate* option = nullptr;  // option whose value is the next word
  for (const std::string& word : words) {
    if (option != nullptr) {
      option = nullptr;
    } else if (absl::StartsWith(word, "-")) {
      option = find(candidates, "option", word);
      if (option != nullptr && option->value.front() == "-") option = nullptr;
    } else if (find(candidates, "command", word) != nullptr) {
      path += absl::StrCat(" ", word);
      candidates = candidates_of(table, path);
    } else if (!candidates.empty() && candidates.front().kind == "command") {
      return {};  // no command is called `word`
    } else {
      ++arguments;
    }
  }
  std::vector<std::string> found;
  if (option != nullptr) {
    found = words_of_value(*option, scenes);
  } else if (absl::StartsWith(last, "-")) {
    for (const Candidate& candidate : candidates) {
      if (candidate.kind == "option") found.push_back(candidate.word);
    }
  } else {
    size_t position = 0;
    for (const Candidate& candidate : candidates) {
      if (candidate.kind == "command") found.push_back(candidate.word);
      if (candidate.kind != "positional" || position++ != arguments) continue;
      const std::vector<std::string> values = words_of_value(candidate, scenes);
      found.insert(found.end(), values.begin(), values.end());
    }
  }
  std::erase_if(found, [&](const std::string& word) { return !absl::StartsWith(word, last); });
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

}  // namespace locus::cli
