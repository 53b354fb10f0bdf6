#include "deploy/manual/programs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/cli/run.h"
#include "deploy/manual/roff.h"
#include "server/config/server_parser.h"

namespace locus::manual {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Expects the page of the command, and the pages of its subcommands, to contain each option and positional, and at
// least one example.
void expect_pages(const cli::CommandWords& command, const std::string& section,
                  std::map<std::string, std::string>& pages) {
  const std::string file = absl::StrCat(absl::StrReplaceAll(command.path, {{" ", "-"}}), ".", section);
  ASSERT_EQ(pages.count(file), 1u) << file;
  const std::string& roff = pages[file];
  for (const cli::OptionWords& option : command.options) {
    for (const std::string& name : option.names) EXPECT_THAT(roff, HasSubstr(bold(name))) << file;
    for (const std::string& choice : option.choices) EXPECT_THAT(roff, HasSubstr(escaped(choice))) << file;
  }
  for (const cli::OptionWords& option : command.positionals) EXPECT_THAT(roff, HasSubstr(italic(option.value))) << file;
  EXPECT_THAT(roff, ::testing::AllOf(HasSubstr(".nf\n"), Not(HasSubstr(".nf\n.fi")))) << file << " has no example";
  for (const char* heading : {"NAME", "SYNOPSIS", "DESCRIPTION", "OPTIONS", "EXIT STATUS", "ENVIRONMENT", "SEE ALSO"}) {
    EXPECT_THAT(roff, HasSubstr(absl::StrCat(".SH ", heading, "\n"))) << file;
  }
  for (const cli::CommandWords& below : command.commands) expect_pages(below, section, pages);
}

std::map<std::string, std::string> by_file(const std::vector<Page>& pages) {
  std::map<std::string, std::string> map;
  for (const Page& page : pages) map[page.file] = page.text;
  return map;
}

TEST(ProgramsTest, LocusAndEachOfItsCommandsHasAPageWithAllItsOptions) {
  std::ostringstream nowhere;
  cli::Context context(nowhere, nowhere, cli::Progress::kSilent);
  CLI::App app;
  cli::build_cli(app, context);
  std::map<std::string, std::string> pages = by_file(pages_of_locus());
  EXPECT_GE(pages.size(), 20u);
  expect_pages(cli::words_of(app), "1", pages);
}

TEST(ProgramsTest, LocusdAndItsCommandsHavePagesWithAllOptionsAndVariables) {
  server::ServerConfig config;
  CLI::App app;
  server::build_parser(app, config);
  std::optional<server::Maintenance> maintenance;
  server::add_maintenance(app, maintenance);
  std::map<std::string, std::string> pages = by_file(pages_of_locusd());
  expect_pages(cli::words_of(app), "8", pages);
  EXPECT_THAT(pages["locusd.8"], HasSubstr("LOCUS_DRAIN_GRACE_S"));
  EXPECT_THAT(pages["locusd.8"], Not(HasSubstr("LOCUS_HELP")));
}

}  // namespace
}  // namespace locus::manual
