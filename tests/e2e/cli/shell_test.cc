// `locus shell` on a pseudo terminal and on a pipe: history, completion, several lines, Ctrl-C and the end of input.
#include <filesystem>
#include <fstream>

#include "tests/support/built_program.h"
#include "tests/support/pseudo_terminal.h"
#include "tests/support/rpc_test.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text_of.h"

namespace locus::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kCtrlC[] = "\x03";
constexpr char kCtrlD[] = "\x04";
constexpr char kUp[] = "\x1b[A";

class ShellTest : public RpcTest {
 protected:
  PseudoTerminal shell() {
    return PseudoTerminal({built_program("locus"), "-a", running_.address(), "shell"},
                          {"TERM=xterm", "XDG_CONFIG_HOME=" + folder_.file("config")});
  }
  void SetUp() override {
    RpcTest::SetUp();
    std::filesystem::create_directories(folder_.file("config/locus"));
  }
  std::string history() const { return folder_.file("config/locus/history"); }

  TemporaryFolder folder_;
};

TEST_F(ShellTest, CommandsAndLuaRunAtThePrompt) {
  PseudoTerminal shell = this->shell();
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("server " + running_.address()));
  shell.type("scene list\r");
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("world"));
  shell.type("world = locus.scene('world')\r");
  shell.read_until("locus> ");
  shell.type("world:updates():insert{id = 7, at = {0, 0, 0}, ball = 1}:commit().applied + 40\r");
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("\r\n41\r\n"));
  shell.type("query ball world --at 0,0,0 --radius 1\r");
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("7"));
  shell.type("qury ball\r");
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("error: `qury` is no command; did you mean `query`?"));
  shell.type("limts\r");
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("did you mean `limits`?"));
  shell.type("locus scene list\r");
  EXPECT_THAT(shell.read_until("locus> "), AllOf(HasSubstr("world"), Not(HasSubstr("error"))));
  shell.type("query bal world\r");
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("did you mean `ball`?"));
  shell.type("error('thrown')\r");
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("error: input:1: thrown"));
  shell.type("help\r");
  EXPECT_THAT(shell.read_until("locus> "), AllOf(HasSubstr("use SCENE"), HasSubstr("  query")));
  shell.type("use world\r");
  shell.read_until("locus> ");
  shell.type("get --id 7\r");
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("0.0,0.0,0.0"));
  shell.type("locus, print = nil, nil\r");
  shell.read_until("locus> ");
  shell.type("5, {id = 6}\r");
  EXPECT_THAT(shell.read_until("locus> "), AllOf(HasSubstr("\r\n5\r\n"), HasSubstr("6")));
  shell.type("exit\r");
  EXPECT_EQ(shell.wait(), 0);
}

TEST_F(ShellTest, StatementsOfSeveralLinesAreReadToTheirEnd) {
  PseudoTerminal shell = this->shell();
  shell.read_until("locus> ");
  shell.type("for i = 1, 3 do\r");
  shell.read_until("...> ");
  shell.type("print('row', i)\r");
  shell.read_until("...> ");
  shell.type("end\r");
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("row\t1\r\nrow\t2\r\nrow\t3\r\n"));
  shell.type("for i = 1, 3 do\r");
  shell.read_until("...> ");
  shell.type(kCtrlC);
  EXPECT_THAT(shell.read_until("locus> "), Not(HasSubstr("error")));
  shell.type(kCtrlC);  // on an empty line
  shell.read_until("locus> ");
  shell.type("1 + 1\r");
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("\r\n2\r\n"));
}

TEST_F(ShellTest, LinesAreFoundAgainInTheNextShell) {
  {
    PseudoTerminal shell = this->shell();
    shell.read_until("locus> ");
    shell.type("print('remember' .. 'ed')\r");
    shell.read_until("remembered\r\n");
    shell.read_until("locus> ");
    shell.type(kUp);
    shell.read_until("print('remember' .. 'ed')");
    shell.type("\r");
    shell.read_until("remembered\r\n");
    shell.read_until("locus> ");
    shell.type(kCtrlD);
    EXPECT_EQ(shell.wait(), 0);
  }
  PseudoTerminal shell = this->shell();
  shell.read_until("locus> ");
  shell.type(kUp);
  shell.read_until("print('remember' .. 'ed')");
  shell.type("\r");
  EXPECT_THAT(shell.read_until("remembered\r\n"), HasSubstr("remembered"));
  const auto all = std::filesystem::perms::group_all | std::filesystem::perms::others_all;
  EXPECT_EQ(std::filesystem::status(history()).permissions() & all, std::filesystem::perms::none)
      << "only the user may read the history";
}

TEST_F(ShellTest, TabCompletesCommandsOptionsAndScenes) {
  PseudoTerminal shell = this->shell();
  shell.read_until("locus> ");
  shell.type("que\tba\two\t--at 0,0,0 --radi\t1\r");
  EXPECT_THAT(shell.read_until("locus> "), AllOf(HasSubstr("revision"), Not(HasSubstr("error"))));
  shell.type("scene de\t");
  shell.type("\t");
  EXPECT_THAT(shell.read_until("describe"), HasSubstr("delete  describe"));
}

TEST_F(ShellTest, CtrlCEndsTheLineTheScriptAndTheCallButNotTheShell) {
  PseudoTerminal shell = this->shell();
  shell.read_until("locus> ");
  shell.type("scene delete world");
  shell.read_until("delete world");
  shell.type(kCtrlC);
  shell.read_until("locus> ");
  shell.type("print('begun') while true do end\r");
  shell.read_until("begun\r\n");
  shell.type(kCtrlC);
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("interrupted"));
  shell.type("print('begun') locus.sleep(3600)\r");
  shell.read_until("begun\r\n");
  shell.type(kCtrlC);
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("interrupted"));
  // A query of a revision that never comes waits at the server.
  shell.type("print('begun') locus.command('query ball world --at 0,0,0 --radius 1 --at-least 1000000')\r");
  shell.read_until("begun\r\n");
  shell.type(kCtrlC);
  EXPECT_THAT(shell.read_until("locus> "), AllOf(HasSubstr("interrupted"), Not(HasSubstr("not answered in time"))));
  shell.type("scene list\r");
  EXPECT_THAT(shell.read_until("locus> "), HasSubstr("world")) << "the dropped line did not run";
  shell.type("exit\r");
  EXPECT_EQ(shell.wait(), 0);
}

TEST_F(ShellTest, APipeIsReadWithoutPromptAndToItsEnd) {
  const std::string script = folder_.file("lines");
  std::ofstream(script) << "scene list\nget world --id 9\nfor i = 1, 2 do\nprint('row', i)\nend\nprint('last')\n";
  const std::string command = built_program("locus") + " -a " + running_.address() + " shell < " + script + " > " +
                              folder_.file("out") + " 2> " + folder_.file("err");
  EXPECT_EQ(std::system(command.c_str()), 0);
  const std::string out = text_of(folder_.file("out"));
  EXPECT_THAT(out, AllOf(HasSubstr("world"), HasSubstr("row\t1\nrow\t2\nlast\n"), Not(HasSubstr("locus>"))));
  EXPECT_THAT(text_of(folder_.file("err")), HasSubstr("error: "));
}

}  // namespace
}  // namespace locus::test
