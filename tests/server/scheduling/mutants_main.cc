// Main function of the tests of leases that are linked with planted bugs: see tests/support/mutants.h.
#include "tests/support/mutants.h"

namespace locus::test {
namespace {

constexpr Mutant kMutants[] = {{"LeaseTwice", PlantedBug::kLeaseTwice}};

}  // namespace
}  // namespace locus::test

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  return locus::test::run_mutants("leases", locus::test::kMutants);
}
