#include "client/cli/script/runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <sstream>

#include "client/cli/failure.h"
#include "client/cli/script/script_limits.h"
#include "tests/client/lib/fake_server.h"

namespace locus::cli {
namespace {

using client::testing::FakeServer;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class RunnerTest : public ::testing::Test {
 protected:
  RunnerTest() { context_.options().connection.address = server_.address(); }

  // Checks the script and, if it has no mistake, runs it. Returns the exit code that the program would have.
  ExitCode run(const std::string& text, AfterFailure after = AfterFailure::kStop) {
    const absl::StatusOr<Script> script = parse_script("x.locus", text);
    EXPECT_TRUE(script.ok()) << script.status();
    ScriptCounts checked;
    counts_ = {};
    mistake_ = check_script(*script, variables_, context_, checked);
    if (!mistake_.ok()) return exit_code_of(mistake_);
    return exit_code_of(run_script(*script, variables_, after, context_, counts_));
  }
  std::string mistake_in(const std::string& text) {
    EXPECT_EQ(run(text), ExitCode::kUsage) << text;
    return std::string(mistake_.message());
  }
  // Makes the fake server answer every query with one hit of object 7.
  void answer_hits() {
    server_.queries.answer = [](const v1::QueryRequest&, v1::QueryResult& result) {
      result.set_revision(12);
      v1::BlockResult& block = *result.add_blocks();
      block.add_t(2.5f);
      block.add_ids(7);
      return grpc::Status::OK;
    };
  }

  FakeServer server_;
  std::ostringstream out_;
  std::ostringstream err_;
  Context context_{out_, err_, Progress::kSilent};
  Variables variables_;
  absl::Status mistake_;
  ScriptCounts counts_;
};

constexpr char kRay[] = "query ray arena --from 0,0,9 --dir 0,0,-1 --columns t";

TEST_F(RunnerTest, ResultsAreKeptAndExpectationsCounted) {
  answer_hits();
  const std::string script = std::string(kRay) + " -> shot\nexpect $shot.id == 7\nexpect $shot.t * 2 == 5\n";
  EXPECT_EQ(run(script), ExitCode::kOk) << err_.str();
  EXPECT_EQ(counts_.lines, 3u);
  EXPECT_EQ(counts_.passed, 2u);
  EXPECT_EQ(counts_.failed, 0u);
}

TEST_F(RunnerTest, AFailedExpectationNamesLineAndValueAndEndsTheRun) {
  answer_hits();
  EXPECT_EQ(run(std::string(kRay) + " -> shot\n\nexpect $shot.id == 2\necho never\n"), ExitCode::kFailed);
  EXPECT_EQ(err_.str(), "error: x.locus:3: expected $shot.id == 2, but it is 7\n");
  EXPECT_THAT(out_.str(), Not(HasSubstr("never")));
  EXPECT_EQ(counts_.failed, 1u);
}

TEST_F(RunnerTest, ACommandThatFailsGivesItsOwnExitCodeAndItsLine) {
  EXPECT_EQ(run("scene describe nowhere"), ExitCode::kNotFound);
  EXPECT_THAT(err_.str(), HasSubstr("error: x.locus:1: no scene is named nowhere\nhint: `locus scene list`"));
  server_.scenes.denied = true;
  EXPECT_EQ(run("scene delete arena"), ExitCode::kDenied);
}

TEST_F(RunnerTest, KeepGoingPrintsEachFailureAndCountsThem) {
  EXPECT_EQ(run("expect 1 == 2\nscene describe nowhere\nlet x = 1\nexpect $x == 1\necho on", AfterFailure::kGoOn),
            ExitCode::kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("x.locus:1: expected 1 == 2, but it is 1"));
  EXPECT_THAT(err_.str(), HasSubstr("x.locus:2: no scene"));
  EXPECT_EQ(out_.str(), "on\n");
  EXPECT_EQ(counts_.lines, 5u);
  EXPECT_EQ(counts_.passed, 1u);
  EXPECT_EQ(counts_.failed, 1u);
  EXPECT_EQ(counts_.broken, 1u);
}

TEST_F(RunnerTest, KeepGoingEndsIfTheServerCannotBeReached) {
  context_.options().connection.address = "unix:/nonexistent/locus.sock";
  EXPECT_EQ(run("scene list\necho never", AfterFailure::kGoOn), ExitCode::kUnreachable);
  EXPECT_THAT(out_.str(), IsEmpty());
}

TEST_F(RunnerTest, LoopsCountFromZeroAndNest) {
  EXPECT_EQ(run("repeat 2 as i\nrepeat 3 as j\necho $i$j\nend\nend\nrepeat 0\necho never\nend"), ExitCode::kOk);
  EXPECT_EQ(out_.str(), "00\n01\n02\n10\n11\n12\n");
}

TEST_F(RunnerTest, ALoopMayChangeWhatItReads) {
  EXPECT_EQ(run("let x = 1\nrepeat 3\nlet x = $x * 2\nend\nexpect $x == 8"), ExitCode::kOk) << err_.str();
}

TEST_F(RunnerTest, ALoopHasALimit) {
  EXPECT_EQ(mistake_in("repeat 100001\nend"),
            "x.locus:1: the number of repetitions is an integer from 0 to 100000, not 100001");
  EXPECT_THAT(mistake_in("repeat -1\nend"), HasSubstr("not -1"));
  EXPECT_THAT(mistake_in("repeat 1.5\nend"), HasSubstr("not 1.5"));
  EXPECT_THAT(mistake_in("repeat 2 as\nend"), HasSubstr("found `as`"));
  EXPECT_THAT(mistake_in("repeat 2 as 7\nend"), HasSubstr("expected `repeat N as NAME`"));
}

TEST_F(RunnerTest, TheLinesOfAllLoopsTogetherHaveALimit) {
  EXPECT_EQ(run("repeat 100000\nrepeat 100000\nend\nend"), ExitCode::kFailed);
  EXPECT_EQ(counts_.lines, kMaxLinesRun + 1);
}

TEST_F(RunnerTest, ABatchIsSentOnceWithItsTick) {
  EXPECT_EQ(run("begin --tick {3 + 4}\nrepeat 3 as i\ninsert arena point --id {1 + $i} --at $i,0,0\nend\n"
                "move arena --id 9 --to 1,1,1\ncommit -> ack\nexpect $ack.revision == 1"),
            ExitCode::kOk)
      << err_.str();
  EXPECT_EQ(server_.updates.calls, 1);
  EXPECT_EQ(server_.updates.last_batch.tick(), 7u);
  EXPECT_EQ(server_.updates.last_batch.inserts_size(), 3);
  EXPECT_EQ(server_.updates.last_batch.moves_size(), 1);
}

TEST_F(RunnerTest, AnEmptyBatchIsAMistake) {
  EXPECT_EQ(run("begin\ncommit"), ExitCode::kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("x.locus:2: the batch is empty"));
}

TEST_F(RunnerTest, ABatchThatFailsSendsNothing) {
  EXPECT_EQ(run("begin\nmove arena --id 1 --to 0,0,0\nremove arena --id 1\ncommit"), ExitCode::kUsage);
  EXPECT_THAT(err_.str(), HasSubstr("x.locus:3: a batch removes, then inserts, then moves"));
  EXPECT_EQ(server_.updates.calls, 0);
  EXPECT_EQ(run("remove arena --id 1"), ExitCode::kOk) << "no batch is left open";
}

TEST_F(RunnerTest, IfBeginFailsTheWholeBatchIsSkipped) {
  variables_.set("t", Value::of(Json("soon"))).IgnoreError();
  // The value of `u` is unknown while the script is checked, since the loop sets it.
  EXPECT_EQ(
      run("repeat 1\nlet u = $t\nbegin --tick $u\nremove arena --id 1\ncommit\nend\necho on", AfterFailure::kGoOn),
      ExitCode::kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("x.locus:3: a tick is an integer from 0, not soon"));
  EXPECT_EQ(server_.updates.calls, 0);
  EXPECT_EQ(out_.str(), "on\n");
}

TEST_F(RunnerTest, ExpectErrorPassesOnExactlyThatFailure) {
  v1::ItemError error;
  error.set_reason(v1::REASON_UNKNOWN_ID);
  server_.updates.item_errors = {error};
  EXPECT_EQ(run("expect-error UNKNOWN_ID move arena --id 8 --to 0,0,0\n"
                "begin\nremove arena --id 8\nexpect-error UNKNOWN_ID commit\n"
                "expect-error NOT_FOUND scene describe nowhere\nexpect-error USAGE get arena\n"
                "expect-error USAGE no-such-command"),
            ExitCode::kOk)
      << err_.str();
  EXPECT_EQ(counts_.passed, 5u);
}

TEST_F(RunnerTest, ExpectErrorFailsOnAnotherFailureAndOnSuccess) {
  EXPECT_EQ(run("expect-error UNKNOWN_ID scene describe nowhere"), ExitCode::kFailed);
  EXPECT_EQ(err_.str(), "error: x.locus:1: expected UNKNOWN_ID, but it is NOT_FOUND: no scene is named nowhere\n");
  err_.str("");
  EXPECT_EQ(run("expect-error NOT_FOUND scene list"), ExitCode::kFailed);
  EXPECT_EQ(err_.str(), "error: x.locus:1: expected NOT_FOUND, but it succeeded\n");
}

TEST_F(RunnerTest, UseNamesTheSceneOfLinesWithoutOne) {
  EXPECT_EQ(run("let hall = 'the-hall'\nuse $hall\nremove --id 1\nremove arena --id 1"), ExitCode::kOk) << err_.str();
  EXPECT_THAT(server_.updates.scenes, ElementsAre("the-hall", "arena"));
}

TEST_F(RunnerTest, QueriesSeeTheLastAckOfTheScript) {
  answer_hits();
  EXPECT_EQ(run("remove arena --id 1\nremove arena --id 1\n" + std::string(kRay)), ExitCode::kOk);
  EXPECT_EQ(server_.queries.last_batch.view().at_least(), 2u);
}

TEST_F(RunnerTest, OptionsOfALineHoldForThatLine) {
  EXPECT_EQ(run("-o json scene list\nscene list"), ExitCode::kOk);
  EXPECT_EQ(out_.str(), "{\n  \"scenes\": []\n}\nno scenes\n");
}

TEST_F(RunnerTest, EchoPrintsAndSleepWaits) {
  EXPECT_EQ(run("sleep 0.001\necho 'a  b' {1 + 1} # c"), ExitCode::kOk);
  EXPECT_EQ(out_.str(), "a  b 2\n");
  out_.str("");
  context_.options().format = Format::kNdjson;
  EXPECT_EQ(run("echo hi"), ExitCode::kOk);
  EXPECT_EQ(out_.str(), "{\"echo\":\"hi\"}\n");
}

TEST_F(RunnerTest, ACheckFindsEveryKindOfMistakeAndSendsNothing) {
  for (const auto& [line, message] : std::vector<std::pair<std::string, std::string>>{
           {"query ray arena --from 0,0,0", "give --from and --dir"},
           {"query ray --from 0,0,0 --dir 0,0,1", "SCENE is required"},
           {"query ray arena --from 0,0 --dir 0,0,1", "--from"},
           {"insert arena ball --id 1 --at 0,0,0", "a ball needs --radius"},
           {"get arena", "nothing to get"},
           {"no-such-command", "no-such-command"},
           {"run x.locus", "run"},
           {"-a 127.0.0.1:1 scene list", "a script has one connection: give --address before `run`"},
           {"--timeout 1 scene list", "give --timeout before `run`"},
           {"get arena --id $nobody", "$nobody is not defined"},
           {"echo $nobody", "$nobody is not defined"},
           {"let 1x = 2", "expected `let NAME = EXPRESSION`"},
           {"let x 2", "expected `let NAME = EXPRESSION`"},
           {"let x = 2 3", "expected the end of the line, found `3`"},
           {"let x = 1 / 0", "division by zero"},
           {"use", "expected `use SCENE`"},
           {"sleep 3601", "sleep takes 0 to 3600 seconds"},
           {"sleep -1", "sleep takes 0 to 3600 seconds"},
           {"expect 1 = 1", "expected one of =="},
           {"scene list -> 1x", "`-> NAME` stores a result and must end the line"},
           {"scene list -> a b", "`-> NAME` stores a result and must end the line"},
           {"expect-error NOT_FOUND scene list -> a", "no result to store"},
           {"expect-error NOT_FOUND no-such-command", "no-such-command"},
           {"begin 7\nremove arena --id 1\ncommit", "expected `begin` or `begin --tick N`"},
           {"begin --tick x\nremove arena --id 1\ncommit", "a tick is an integer"},
           {"begin\nremove arena --id 1 -> a\ncommit", "no result to store"},
           {"begin\nremove arena --id 1\ncommit now", "expected `commit`"},
           {"echo 'open", "not closed"}}) {
    EXPECT_THAT(mistake_in("echo never\n" + line), HasSubstr(message)) << line;
    EXPECT_THAT(mistake_in(line), HasSubstr("x.locus:")) << line;
  }
  EXPECT_THAT(out_.str(), IsEmpty());
  EXPECT_EQ(server_.updates.calls + server_.queries.calls + server_.scenes.creates, 0);
}

TEST_F(RunnerTest, ACheckAcceptsUnknownResultsAsAnyValue) {
  answer_hits();
  EXPECT_EQ(run("let scene = 'arena'\nuse $scene\n" + std::string(kRay) + " -> shot\n" +
                "expect-error USAGE query ray --from $shot.revision --dir {0,0,$shot.t} --mode $shot.tick\n"
                "repeat $shot.revision as i\nremove --id {$i + $shot.id}\nend\n"
                "remove --id=$shot.id"),
            ExitCode::kOk)
      << mistake_ << err_.str();
  EXPECT_EQ(server_.updates.calls, 13);
}

TEST_F(RunnerTest, ACheckLeavesTheSceneAsItWas) {
  context_.use_scene("arena");
  ScriptCounts counts;
  EXPECT_TRUE(check_script(*parse_script("x", "use hall"), variables_, context_, counts).ok());
  EXPECT_EQ(context_.default_scene(), "arena");
  EXPECT_EQ(context_.lines(), Lines::kProgram);
}

TEST_F(RunnerTest, ACalculationThatFailsOnlyWhenRunNamesItsLine) {
  answer_hits();
  EXPECT_EQ(run(std::string(kRay) + " -> shot\nlet x = 1 / ($shot.id - 7)"), ExitCode::kFailed);
  EXPECT_EQ(err_.str(), "error: x.locus:2: division by zero\n");
  EXPECT_EQ(run(std::string(kRay) + " -> shot\nlet x = $shot.nothing"), ExitCode::kFailed) << "not 5, not found";
}

TEST_F(RunnerTest, ACommandWithoutResultCannotStoreOne) {
  EXPECT_EQ(run("--help -> h"), ExitCode::kFailed);
  EXPECT_THAT(err_.str(), HasSubstr("x.locus:1: this command has no result to store"));
}

}  // namespace
}  // namespace locus::cli
