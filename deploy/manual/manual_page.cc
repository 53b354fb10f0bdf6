#include "deploy/manual/manual_page.h"

#include <algorithm>
#include <memory>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "deploy/manual/markdown.h"
#include "deploy/manual/roff.h"

namespace locus::manual {
namespace {

using cli::CommandWords;
using cli::OptionWords;

// Footer of a command's help, split into examples (the indented lines below "Examples:") and notes (all other lines).
struct Footer {
  std::string notes;
  std::vector<std::string> examples;
};

Footer parts_of(const std::string& footer) {
  Footer parts;
  bool in_examples = false;
  for (const absl::string_view line : absl::StrSplit(footer, '\n')) {
    if (line == "Examples:") {
      in_examples = true;
    } else if (in_examples && absl::StartsWith(line, "  ")) {
      parts.examples.emplace_back(line.substr(2));
    } else {
      in_examples = false;
      absl::StrAppend(&parts.notes, std::string(line), "\n");
    }
  }
  return parts;
}

std::string page_name(const std::string& path) { return absl::StrReplaceAll(path, {{" ", "-"}}); }

std::string markup_of(const OptionWords& option, const PageForm& page) {
  const std::string value = option.value.empty() ? "" : page.variable(option.value);
  if (option.names.empty()) return value;
  std::vector<std::string> names;
  for (const std::string& name : option.names) names.push_back(page.typed(name));
  return absl::StrCat(absl::StrJoin(names, ", "), value.empty() ? "" : " ", value);
}

// Returns `text` with exactly one full stop at its end.
std::string sentence(const std::string& text) { return absl::StrCat(absl::StripSuffix(text, "."), "."); }

// Returns the first sentence of `description` on one line. whatis(1) indexes this line.
std::string summary(const std::string& description) {
  const std::string line = absl::StrReplaceAll(description, {{"\n", " "}});
  return std::string(absl::StripSuffix(line.substr(0, line.find(". ")), "."));
}

// Returns the option's description as a sentence, followed by its choices, default and other properties.
std::string text_of(const OptionWords& option) {
  std::string text = sentence(option.description);
  const bool names_choices = std::all_of(option.choices.begin(), option.choices.end(), [&](const std::string& choice) {
    return absl::StrContains(option.description, choice);
  });
  if (!names_choices) absl::StrAppend(&text, " One of ", absl::StrJoin(option.choices, ", "), ".");
  if (!option.default_text.empty()) absl::StrAppend(&text, " Default: ", option.default_text, ".");
  if (option.required && !option.names.empty()) absl::StrAppend(&text, " Required.");
  if (option.repeatable) absl::StrAppend(&text, " May be repeated.");
  return text;
}

void add_synopsis(const CommandWords& command, PageForm& page) {
  std::vector<std::string> parts;
  for (const OptionWords& option : command.options) {
    if (option.required)
      parts.push_back(absl::StrCat(page.typed(option.names.back()), " ", page.variable(option.value)));
  }
  parts.push_back(absl::StrCat("[", page.variable("OPTION"), "]..."));
  for (const OptionWords& option : command.positionals) {
    parts.push_back(option.required ? page.variable(option.value)
                                    : absl::StrCat("[", page.variable(option.value), "]"));
  }
  if (!command.commands.empty()) parts.push_back(absl::StrCat(page.variable("COMMAND"), " ..."));
  page.heading("SYNOPSIS").synopsis(page.typed(command.path), absl::StrJoin(parts, " "));
}

void add_options(const CommandWords& command, const std::string& program, const Manual& manual, PageForm& page) {
  page.heading("OPTIONS");
  for (const OptionWords& option : command.positionals) page.item(markup_of(option, page), text_of(option));
  for (const OptionWords& option : command.options) page.item(markup_of(option, page), text_of(option));
  if (command.path != program) {
    page.text(absl::StrCat("\nThe options of ", program, "(", manual.section, ") may stand here too."));
  }
}

void add_commands(const CommandWords& command, const Manual& manual, PageForm& page) {
  if (command.commands.empty()) return;
  page.heading("COMMANDS");
  for (const CommandWords& below : command.commands) {
    page.item(page.reference(page_name(below.path), manual.section), sentence(below.description));
  }
}

void add_explained(const std::string& heading, const Explained& words, PageForm& page) {
  if (words.empty()) return;
  page.heading(heading);
  for (const auto& [word, text] : words) page.item(page.typed(word), text);
}

// Adds `notes` to `page`. Indented lines are printed literally, other lines as running text.
void add_notes(const std::string& notes, PageForm& page) {
  std::string running;
  std::vector<std::string> kept;
  const auto flush = [&] {
    if (!running.empty()) page.text(running);
    if (!kept.empty()) page.literal(kept);
    running.clear();
    kept.clear();
  };
  for (const absl::string_view line : absl::StrSplit(notes, '\n')) {
    const bool indented = absl::StartsWith(line, "  ");
    if (indented == kept.empty()) flush();
    if (indented) {
      kept.emplace_back(line.substr(2));
    } else {
      absl::StrAppend(&running, std::string(line), "\n");
    }
  }
  flush();
}

std::unique_ptr<PageForm> begin_page(const CommandWords& command, const std::string& program, const Manual& manual,
                                     Form form) {
  if (form == Form::kMarkdown) return std::make_unique<MarkdownPage>(command.path);
  return std::make_unique<RoffPage>(absl::AsciiStrToUpper(page_name(command.path)), manual.section,
                                    absl::StrCat(program, " ", manual.version));
}

std::string written(const CommandWords& command, const std::string& program, const Manual& manual, Form form) {
  const Footer footer = parts_of(command.footer);
  const std::unique_ptr<PageForm> begun = begin_page(command, program, manual, form);
  PageForm& page = *begun;
  page.name(page_name(command.path), summary(command.description));
  add_synopsis(command, page);
  page.heading("DESCRIPTION");
  add_notes(absl::StrCat(sentence(command.description), "\n\n", footer.notes), page);
  add_commands(command, manual, page);
  add_options(command, program, manual, page);
  page.heading("EXAMPLES").examples(footer.examples);
  // A page of the site links to the page of the program instead of repeating what holds for all commands.
  if (form == Form::kRoff || command.path == program) {
    add_explained("EXIT STATUS", manual.exit_statuses, page);
    add_explained("ENVIRONMENT", manual.variables, page);
  }
  std::vector<std::string> others = manual.see_also;
  if (command.path != program) others.insert(others.begin(), absl::StrCat(program, "(", manual.section, ")"));
  page.heading("SEE ALSO").references(others);
  return page.written();
}

void add_pages(const CommandWords& command, const std::string& program, const Manual& manual, Form form,
               std::vector<Page>& pages) {
  const std::string ending = form == Form::kRoff ? manual.section : "md";
  pages.push_back({absl::StrCat(page_name(command.path), ".", ending), written(command, program, manual, form)});
  for (const CommandWords& below : command.commands) add_pages(below, program, manual, form, pages);
}

}  // namespace

std::vector<Page> manual_pages(const CommandWords& program, const Manual& manual, Form form) {
  std::vector<Page> pages;
  add_pages(program, program.path, manual, form, pages);
  return pages;
}

}  // namespace locus::manual
