// Main function of the tests of the cluster that are linked with planted bugs: see tests/support/mutants.h.
#include "tests/support/mutants.h"

namespace locus::test {
namespace {

constexpr Mutant kMutants[] = {
    {"SilenceCountedWhileTheEngineIsAway", PlantedBug::kSilenceWithoutBeats},
    {"LeaseNotCheckedAfterAPause", PlantedBug::kLeaseUnchecked},
    {"LeaseCountedFromTheAnswer", PlantedBug::kLeaseFromAnswer},
    {"MemberMarkedDeadAlthoughItHasBeaten", PlantedBug::kMarkAnyBeat},
    {"TokenNotCheckedInTakeOver", PlantedBug::kTakeOverAnyToken},
    {"TokenNotCheckedInHandOver", PlantedBug::kHandOverAnyToken},
    {"LeaseNotStoppedBeforeHandOver", PlantedBug::kHandedOverLeadsOn},
    {"LeaseNotEndedByDeath", PlantedBug::kDeadLeadsOn},
};

}  // namespace
}  // namespace locus::test

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  return locus::test::run_mutants("the cluster", locus::test::kMutants);
}
