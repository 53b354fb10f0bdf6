#include "client/cli/shell/completer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "client/cli/command_words.h"
#include "client/cli/run.h"

namespace locus::cli {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

class CompleterTest : public ::testing::Test {
 protected:
  CompleterTest() {
    Context context(out_, out_, Progress::kSilent);
    context.set_lines(Lines::kScript);
    CLI::App app;
    build_cli(app, context);
    table_ = completion_table(words_of(app));
  }
  std::vector<std::string> words(const std::string& line) {
    return complete(table_, line, [this] {
      ++asked_;
      return std::vector<std::string>{"arena", "hall"};
    });
  }

  std::ostringstream out_;
  std::vector<TableEntry> table_;
  int asked_ = 0;
};

TEST_F(CompleterTest, CommandsAreCompletedAtEachLevel) {
  EXPECT_THAT(words("sce"), ElementsAre("scene"));
  EXPECT_THAT(words(""), Contains("query"));
  EXPECT_THAT(words("scene "), Contains("list"));
  EXPECT_THAT(words("scene de"), ElementsAre("delete", "describe"));
  EXPECT_THAT(words("query ra"), ElementsAre("ray"));
  EXPECT_THAT(words("nothing "), IsEmpty());
  EXPECT_EQ(asked_, 0) << "no scene may stand there";
}

TEST_F(CompleterTest, OptionsAndTheirWordsAreCompleted) {
  EXPECT_THAT(words("query ray arena --mo"), ElementsAre("--mode"));
  EXPECT_THAT(words("query ray arena --mode a"), ElementsAre("all", "any"));
  EXPECT_THAT(words("query ray arena --from "), IsEmpty()) << "any value";
  EXPECT_THAT(words("-o js"), ElementsAre("json"));
  EXPECT_THAT(words("query ray -o js"), ElementsAre("json")) << "options of the program hold everywhere";
}

TEST_F(CompleterTest, ScenesStandWhereTheCommandHasOne) {
  EXPECT_THAT(words("query ray "), ElementsAre("arena", "hall"));
  EXPECT_THAT(words("query ray ha"), ElementsAre("hall"));
  EXPECT_THAT(words("query ray --mode all ha"), ElementsAre("hall"));
  EXPECT_THAT(words("query ray arena "), Not(Contains("hall"))) << "one scene is enough";
}

}  // namespace
}  // namespace locus::cli
