// Main function of the tests of PostgresLog that are linked with planted bugs: see tests/support/mutants.h.
#include "tests/support/mutants.h"
#include "tests/support/postgres_server.h"

namespace locus::test {
namespace {

constexpr Mutant kMutants[] = {
    {"AppendWithoutToken", PlantedBug::kAppendWithoutToken}, {"ResolvedByPlainRead", PlantedBug::kResolvedByPlainRead},
    {"EngineHostKept", PlantedBug::kEngineHostKept},         {"ChainNotCompared", PlantedBug::kChainNotCompared},
    {"WarningIgnored", PlantedBug::kWarningIgnored},         {"LostAppendKept", PlantedBug::kLostAppendKept}};
constexpr int kSkipped = 77;

}  // namespace
}  // namespace locus::test

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  if (!locus::test::PostgresServer::installed()) {
    std::puts(locus::test::PostgresServer::kMissing);
    return locus::test::kSkipped;
  }
  return locus::test::run_mutants("the log in PostgreSQL", locus::test::kMutants);
}
