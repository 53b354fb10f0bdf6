// Default scenes of contexts, against a real server.
#include <fstream>
#include <sstream>

#include "client/cli/run.h"
#include "tests/support/cli_outcome.h"
#include "tests/support/rpc_test.h"
#include "tests/support/temporary_folder.h"

namespace locus::test {
namespace {

using cli::Json;
using ::testing::HasSubstr;

class ContextsTest : public RpcTest {
 protected:
  void SetUp() override {
    RpcTest::SetUp();
    ASSERT_TRUE(create("other").ok());
    ASSERT_EQ(run({"context", "add", "here", "--address", running_.address(), "--scene", "world"}).code,
              cli::ExitCode::kOk);
    ASSERT_EQ(run({"context", "use", "here"}).code, cli::ExitCode::kOk);
  }

  // `scene` is the value of LOCUS_SCENE.
  Outcome run(const std::vector<std::string>& arguments, const std::string& scene = "") {
    std::ostringstream out;
    std::ostringstream err;
    cli::Context context(out, err, cli::Progress::kSilent);
    context.set_contexts_path(folder_.file("contexts"));
    context.use_scene(scene);
    const cli::ExitCode code = cli::run_line(arguments, context);
    return {code, out.str(), err.str()};
  }

  // Returns the number of objects of the scenes world and other.
  std::pair<uint64_t, uint64_t> objects() { return {get("world").objects(), get("other").objects()}; }

  TemporaryFolder folder_;
};

TEST_F(ContextsTest, LinesWithoutASceneUseThatOfTheContext) {
  const Outcome inserted = run({"insert", "point", "--id", "1", "--at", "0,0,0"});
  ASSERT_EQ(inserted.code, cli::ExitCode::kOk) << inserted.err;
  EXPECT_EQ(objects(), std::pair(uint64_t{1}, uint64_t{0}));
  const Outcome generated = run({"generate", "city", "--triangles", "600"});
  EXPECT_EQ(generated.code, cli::ExitCode::kOk) << generated.err;
  EXPECT_EQ(get("world").instances(), 1u);
  std::ofstream(folder_.file("a.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const Outcome imported = run({"import", folder_.file("a.obj")});
  EXPECT_EQ(imported.code, cli::ExitCode::kOk) << imported.err;
  EXPECT_EQ(get("world").instances(), 2u);
}

TEST_F(ContextsTest, TheLineAndTheEnvironmentWin) {
  ASSERT_EQ(run({"insert", "other", "point", "--id", "1", "--at", "0,0,0"}).code, cli::ExitCode::kOk);
  EXPECT_EQ(objects(), std::pair(uint64_t{0}, uint64_t{1}));
  ASSERT_EQ(run({"insert", "point", "--id", "2", "--at", "0,0,0"}, "other").code, cli::ExitCode::kOk);
  EXPECT_EQ(objects(), std::pair(uint64_t{0}, uint64_t{2}));
}

TEST_F(ContextsTest, AnAddressOnTheLineLeavesTheDefaultContextOut) {
  EXPECT_EQ(run({"--address", running_.address(), "insert", "point", "--id", "1", "--at", "0,0,0"}).code,
            cli::ExitCode::kUsage);
}

TEST_F(ContextsTest, AddRefusesToOverwrite) {
  const Outcome again = run({"context", "add", "here", "--address", "elsewhere:1"});
  EXPECT_EQ(again.code, cli::ExitCode::kFailed);
  EXPECT_THAT(again.err, HasSubstr("there is a context here already"));
  const Json shown = Json::parse(run({"-o", "json", "context", "show"}).out, nullptr, /*allow_exceptions=*/false);
  EXPECT_EQ(shown["address"], running_.address());
  EXPECT_EQ(shown["scene"], "world");
  EXPECT_EQ(run({"context", "set", "here", "--address", "elsewhere:1"}).code, cli::ExitCode::kOk);
}

}  // namespace
}  // namespace locus::test
