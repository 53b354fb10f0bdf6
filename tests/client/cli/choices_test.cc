#include "client/cli/choices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "client/cli/run.h"

namespace locus::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

enum class Colour { kRed = 4, kBlue = 7 };

TEST(ChoicesTest, AWordIsConvertedToItsEnumValue) {
  CLI::App app;
  Colour colour = Colour::kRed;
  app.add_option("--colour", colour)
      ->transform(choices(NamedValues<Colour>{{"red", Colour::kRed}, {"blue", Colour::kBlue}}));
  app.parse("--colour blue");
  EXPECT_EQ(colour, Colour::kBlue);
}

TEST(ChoicesTest, AnUnknownWordIsRefusedWithTheListOfAllowedWords) {
  CLI::App app;
  std::string shape;
  app.add_option("--shape", shape)->check(choices({"point", "ball"}));
  try {
    app.parse("--shape cone");
    FAIL() << "accepted";
  } catch (const CLI::ValidationError& error) {
    EXPECT_THAT(error.what(), HasSubstr("'cone' is none of point, ball"));
  }
}

TEST(ChoicesTest, TheNumberOfAnEnumValueIsRefused) {
  CLI::App app;
  Colour colour = Colour::kRed;
  app.add_option("--colour", colour)->transform(choices(NamedValues<Colour>{{"red", Colour::kRed}}));
  EXPECT_THROW(app.parse("--colour 4"), CLI::ValidationError);
}

TEST(ChoicesTest, ChoicesOfReturnsTheWordsInOrderAlsoBesideOtherChecks) {
  CLI::App app;
  std::string shape;
  CLI::Option& option = *app.add_option("--shape", shape);
  EXPECT_THAT(choices_of(option), IsEmpty());
  option.check(CLI::TypeValidator<std::string>())->check(choices({"point", "ball"}));
  EXPECT_THAT(choices_of(option), ElementsAre("point", "ball"));
}

// Appends all options of `app` and of all its subcommands.
void collect_options(CLI::App& app, std::vector<CLI::Option*>& options) {
  for (CLI::Option* option : app.get_options()) options.push_back(option);
  for (CLI::App* command : app.get_subcommands({})) collect_options(*command, options);
}

TEST(ChoicesTest, NoOptionOfLocusUsesTheParsersOwnCheckForWords) {
  std::ostringstream ignored;
  Context context(ignored, ignored, Progress::kSilent);
  CLI::App app;
  build_cli(app, context);
  std::vector<CLI::Option*> options;
  collect_options(app, options);
  ASSERT_FALSE(options.empty());
  for (CLI::Option* option : options) {
    for (int i = 0; choices_of(*option).empty(); ++i) {
      CLI::Validator* validator = nullptr;
      try {
        validator = option->get_validator(i);
      } catch (const CLI::OptionNotFound&) {
        break;
      }
      const std::string refusal = (*validator)(std::string("no such word"));
      EXPECT_THAT(refusal, ::testing::Not(::testing::AnyOf(HasSubstr(" not in {"), HasSubstr("value in {"))))
          << option->get_name() << ": use choices() of client/cli/choices.h";
    }
  }
}

}  // namespace
}  // namespace locus::cli
