// Query batches of `locus demo`, and a checker that compares the server's answers with brute force. The functions have
// no state; the checker is not thread-safe.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_QUERIES_H_
#define LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_QUERIES_H_

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/extras/demo/brute_force.h"
#include "client/cli/extras/demo/demo_random.h"
#include "client/cli/extras/demo/demo_world.h"
#include "client/lib/client.h"

namespace locus::cli {

enum class DemoKind { kFirst, kAny, kBalls, kBoxes };
inline constexpr std::array<DemoKind, 4> kDemoKinds = {DemoKind::kFirst, DemoKind::kAny, DemoKind::kBalls,
                                                       DemoKind::kBoxes};
// Returns the name that the printed table shows for this kind.
std::string name_of(DemoKind kind);

// Returns a batch of one block with `count` random queries inside the world's bounds.
v1::QueryBatch demo_batch(DemoKind kind, const DemoWorld& world, DemoRandom& random, int count);

// Returns the number of queries of the block that found at least one object or triangle.
uint64_t count_found(const v1::BlockResult& block);

class DemoChecker {
 public:
  // Borrows both arguments, which must outlive the checker.
  DemoChecker(const std::vector<CheckedInstance>& instances, const DemoWorld& world)
      : instances_(instances), world_(world) {}

  struct Outcome {
    uint64_t checked = 0;
    uint64_t differences = 0;
  };
  // Checks the first `max_queries` answers in `result`, which answers `batch`, against brute force on the objects at
  // the tick of `result`. Every id, triangle and distance must be equal bit for bit. Precondition: demo_batch() made
  // `batch`.
  Outcome check(DemoKind kind, const v1::QueryBatch& batch, const v1::QueryResult& result, int max_queries);

 private:
  bool same_ray(DemoKind kind, const v1::QueryBlock& asked, const v1::BlockResult& got, int i) const;
  bool same_rows(const std::vector<OverlapRow>& wanted, const v1::BlockResult& got, int i) const;

  const std::vector<CheckedInstance>& instances_;
  const DemoWorld& world_;
  std::vector<CheckedObject> objects_;
  std::optional<uint64_t> tick_;  // tick to which objects_ belongs
};

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_DEMO_DEMO_QUERIES_H_
