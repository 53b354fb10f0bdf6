// The simulated engine keeps the contract that the engine of the product keeps.
#include "server/cluster/cluster_engine.h"

#include "tests/support/cluster_engine_judge.h"
#include "tests/support/simulated_engine.h"

namespace locus::test {
namespace {

class SimulatedEngineUnderTest : public EngineUnderTest {
 public:
  server::ClusterEngine& engine() override { return engine_; }
  SceneKey add_scene() override {
    engine_.add_scene(++last_);
    return last_;
  }

 private:
  SimulatedEngine engine_;
  SceneKey last_ = 0;
};

INSTANTIATE_TEST_SUITE_P(Simulated, ClusterEngineJudge,
                         ::testing::Values([] { return std::make_unique<SimulatedEngineUnderTest>(); }));

}  // namespace
}  // namespace locus::test
