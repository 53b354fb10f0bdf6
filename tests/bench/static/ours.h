// The only code by which the static suite measures locus. It calls the functions that the server's queries use for a
// mesh. Immutable; any number of threads may use it.
#ifndef LOCUS_TESTS_BENCH_STATIC_OURS_H_
#define LOCUS_TESTS_BENCH_STATIC_OURS_H_

#include <memory>
#include <string>

#include "core/scene/statics/static_mesh.h"
#include "tests/bench/static/peer.h"

namespace locus::bench {

class Ours : public Peer {
 public:
  explicit Ours(const BenchMesh& mesh);

  bool does(Task) const override { return true; }
  void first(absl::Span<const RayQuery> rays, RayAnswer* answers) override;
  void any(absl::Span<const RayQuery> rays, uint8_t* answers) override;
  void ray_ids(absl::Span<const RayQuery> rays, absl::Span<uint32_t> ids, uint32_t* counts) override;
  void ball_ids(absl::Span<const Ballf> balls, absl::Span<uint32_t> ids, uint32_t* counts) override;
  void box_ids(absl::Span<const Obbf> boxes, absl::Span<uint32_t> ids, uint32_t* counts) override;

 private:
  std::shared_ptr<const StaticMesh> mesh_;
};

// Makes a builder that builds the tree from triangles on one thread. Its bytes() returns the bytes of a StaticMesh,
// which contains the uploaded mesh too.
std::unique_ptr<Builder> our_builder(const BenchMesh& mesh);
// Returns a hash of the order in which a built tree stores its triangles: the results_hash of the cases build and
// memory.
std::string storage_order_hash(const BenchMesh& mesh);

}  // namespace locus::bench

#endif  // LOCUS_TESTS_BENCH_STATIC_OURS_H_
