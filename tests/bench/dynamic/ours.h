// The code by which the dynamic suite calls locus: the scene's writer, the scene's index without the query engine, and
// whole batches as the server runs them. Only mixed_batches.h also calls locus directly. One thread; latest() and
// status() may be called from any thread, like those of Scene.
#ifndef LOCUS_TESTS_BENCH_DYNAMIC_OURS_H_
#define LOCUS_TESTS_BENCH_DYNAMIC_OURS_H_

#include <memory>
#include <optional>

#include "core/scene/scene.h"
#include "core/scene/snapshot/scene_at_time.h"
#include "tests/bench/dynamic/contender.h"

namespace locus::bench::dynamic {

// Contender with a Scene. Updates go through the scene's writer: each call is one batch, and each move() one tick.
// Queries go to the index of the latest revision.
class Ours : public Contender {
 public:
  // Makes an empty scene; `history` sets how many past ticks it keeps.
  explicit Ours(const HistoryOptions& history = {});
  bool does(Task) const override { return true; }

  void load(const Objects& objects) override;
  void move(const Moves& moves) override;
  void remove(absl::Span<const uint64_t> ids) override;
  void insert(const Objects& objects) override;
  void forget_past() override;
  void balls(absl::Span<const Vec3f> centers, Answers& answers) override;
  void boxes(absl::Span<const Vec3f> centers, Answers& answers) override;
  void rays(absl::Span<const Rayf> rays, Answers& answers) override;
  void nearest(absl::Span<const Vec3f> centers, Answers& answers) override;

  SnapshotPtr latest() const { return scene_.latest(); }
  SceneStatus status() const { return scene_.status(); }

 private:
  void apply(const UpdateBatch& batch, size_t items);
  template <class RegionOf, class MeetsOf>
  void ask_regions(absl::Span<const Vec3f> centers, Answers& answers, const RegionOf& region_of,
                   const MeetsOf& meets_of);

  Scene scene_;
  SnapshotPtr snapshot_;  // latest snapshot of scene_
  uint64_t tick_ = 0;
};

// Returns a contender that only answers queries about the scene of `ours`. Each call is one batch of one block. The
// queries are about `time` if it is given, otherwise about the present. `reach` is the radius of its balls and half the
// edge of its boxes. Borrows `ours`.
std::unique_ptr<Contender> batches_of(const Ours& ours, std::optional<AsOf> time = {}, float reach = kReach);

}  // namespace locus::bench::dynamic

#endif  // LOCUS_TESTS_BENCH_DYNAMIC_OURS_H_
