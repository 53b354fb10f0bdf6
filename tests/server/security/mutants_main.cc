// Main function of the security tests that are linked with planted bugs: see tests/support/mutants.h.
#include "tests/support/mutants.h"

namespace locus::test {
namespace {

constexpr Mutant kMutants[] = {
    {"RightLeftOut", PlantedBug::kRightLeftOut},
    {"SceneLeftOut", PlantedBug::kSceneLeftOut},
    {"UpdateIsAdmin", PlantedBug::kUpdateIsAdmin},
    {"GlobTooWide", PlantedBug::kGlobTooWide},
    {"TokenByPrefix", PlantedBug::kTokenByPrefix},
    {"TokenNeverExpires", PlantedBug::kTokenNeverExpires},
    {"RevokedTokenStays", PlantedBug::kRevokedTokenStays},
    {"ReloadUnnoticed", PlantedBug::kReloadUnnoticed},
    {"JwtNeverExpires", PlantedBug::kJwtNeverExpires},
    {"JwtForAnyone", PlantedBug::kJwtForAnyone},
    {"JwtWithoutAlgorithm", PlantedBug::kJwtWithoutAlgorithm},
    {"JwtAnySignature", PlantedBug::kJwtAnySignature},
    {"JwtKeyOfAnotherKind", PlantedBug::kJwtKeyOfAnotherKind},
    {"UserFromAfar", PlantedBug::kUserFromAfar},
};

}  // namespace
}  // namespace locus::test

int main(int argc, char** argv) {
  ::testing::InitGoogleTest(&argc, argv);
  return locus::test::run_mutants("access control", locus::test::kMutants);
}
