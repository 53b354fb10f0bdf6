#include "tests/bench/dynamic/ours.h"

#include <array>

#include "core/base/check.h"
#include "core/index/index_queries.h"
#include "core/query/run_batch.h"

namespace locus::bench::dynamic {
namespace {

// Ids of what a region meets exactly.
template <class Region, class Meets>
class Ids {
 public:
  Ids(const Region& region, const Meets& meets, std::vector<uint64_t>& ids)
      : region_(region), meets_(meets), ids_(ids) {}

  Aabbd bounds() const { return region_.bounds(); }
  bool overlaps(const Aabbd& box) const { return region_.overlaps(box); }
  bool visit(const Object& object) {
    if (meets_(object)) ids_.push_back(object.id);
    return true;
  }

 private:
  const Region& region_;
  const Meets& meets_;
  std::vector<uint64_t>& ids_;
};

template <class Region, class Meets>
void collect(const SceneSnapshot& snapshot, const Region& region, const Meets& meets, std::vector<uint64_t>& ids) {
  Work work;
  Ids<Region, Meets> visitor(region, meets, ids);
  snapshot.objects.visit_region(visitor, work);
}

absl::Span<const float> numbers_of(const Vec3f& first, size_t count) {
  static_assert(sizeof(Vec3f) == 3 * sizeof(float));
  return {&first.x, 3 * count};
}

class Batches : public Contender {
 public:
  explicit Batches(const Ours& ours) : Contender("ours_batch"), ours_(ours) {}
  bool does(Task task) const override { return task == Task::kBall || task == Task::kBox || task == Task::kRay; }
  void load(const Objects&) override {}
  void move(const Moves&) override {}

  void balls(absl::Span<const Vec3f> centers, Answers& answers) override {
    BallColumns columns;
    columns.centers = numbers_of(centers.front(), centers.size());
    columns.radii = absl::MakeConstSpan(&kReach, 1);
    ask(columns, answers);
  }
  void boxes(absl::Span<const Vec3f> centers, Answers& answers) override {
    constexpr std::array<float, 3> kHalf = {kReach, kReach, kReach};
    BoxColumns columns;
    columns.centers = numbers_of(centers.front(), centers.size());
    columns.half_extents = kHalf;
    ask(columns, answers);
  }
  void rays(absl::Span<const Rayf> rays, Answers& answers) override {
    origins_.clear();
    directions_.clear();
    for (const Rayf& ray : rays) {
      origins_.push_back(ray.origin);
      directions_.push_back(ray.direction);
    }
    RayColumns columns;
    columns.origins = numbers_of(origins_.front(), rays.size());
    columns.directions = numbers_of(directions_.front(), rays.size());
    columns.t_max = absl::MakeConstSpan(&kRayLength, 1);
    const BlockResult result = run(columns, {Column::kId, Column::kT});
    for (size_t i = 0; i < rays.size(); ++i) {
      answers.counts.push_back(result.ids[i] != kNoId ? 1 : 0);
      if (result.ids[i] == kNoId) continue;
      answers.ids.push_back(result.ids[i]);
      answers.distances.push_back(result.t[i]);
    }
  }

 private:
  template <class Columns>
  BlockResult run(const Columns& columns, ColumnSet wanted) const {
    QueryBatch batch;
    batch.max_reply_bytes = limits::kMaxReplyBytes;
    QueryBlock& block = batch.blocks.emplace_back();
    block.columns = wanted;
    block.max_results = limits::kMaxMaxResults;
    block.kind = columns;
    const absl::Status checked = check_batch(batch);
    LOCUS_CHECK_EQ(checked, absl::OkStatus());
    absl::StatusOr<BatchResult> result = run_batch(*ours_.latest(), batch, {});
    LOCUS_CHECK_EQ(result.status(), absl::OkStatus());
    return std::move(result->blocks.front());
  }
  template <class Columns>
  void ask(const Columns& columns, Answers& answers) const {
    const BlockResult result = run(columns, {Column::kId});
    answers.ids.insert(answers.ids.end(), result.ids.begin(), result.ids.end());
    answers.counts.insert(answers.counts.end(), result.counts.begin(), result.counts.end());
  }

  const Ours& ours_;
  std::vector<Vec3f> origins_, directions_;
};

}  // namespace

Ours::Ours() : Contender("locus"), scene_("bench", {}, 1, StaticSet::empty()) {}

void Ours::apply(const UpdateBatch& batch, size_t items) {
  const absl::StatusOr<UpdateAck> ack = scene_.apply(batch);
  LOCUS_CHECK_EQ(ack.status(), absl::OkStatus());
  LOCUS_CHECK_EQ(size_t{ack->applied}, items);
  snapshot_ = scene_.latest();
}

void Ours::load(const Objects& objects) { insert(objects); }

void Ours::move(const Moves& moves) {
  MoveColumns columns;
  columns.ids = moves.ids;
  columns.positions = moves.positions;
  UpdateBatch batch;
  batch.moves.push_back(columns);
  apply(batch, moves.ids.size());
}

void Ours::remove(absl::Span<const uint64_t> ids) {
  UpdateBatch batch;
  batch.remove_ids = ids;
  apply(batch, ids.size());
}

void Ours::insert(const Objects& objects) {
  InsertColumns columns;
  columns.ids = objects.ids;
  columns.positions = objects.positions;
  columns.kind = ShapeKind::kBall;
  columns.radii = objects.radii;
  UpdateBatch batch;
  batch.inserts.push_back(columns);
  apply(batch, objects.ids.size());
}

void Ours::balls(absl::Span<const Vec3f> centers, Answers& answers) {
  each_region(centers, answers, [&](Vec3f center, std::vector<uint64_t>& ids) {
    const Balld ball = {to_double(center), kReach};
    collect(
        *snapshot_, BallRegion<double>(ball),
        [&](const Object& object) { return PrimitiveTraits<Object>::ball(object, ball); }, ids);
  });
}

void Ours::boxes(absl::Span<const Vec3f> centers, Answers& answers) {
  each_region(centers, answers, [&](Vec3f center, std::vector<uint64_t>& ids) {
    Obbd box;
    box.center = to_double(center);
    box.half = {kReach, kReach, kReach};
    collect(
        *snapshot_, BoxRegion<double>(box),
        [&](const Object& object) { return PrimitiveTraits<Object>::box(object, box); }, ids);
  });
}

void Ours::rays(absl::Span<const Rayf> rays, Answers& answers) {
  each_ray(rays, answers, [&](const Rayf& ray) {
    const ObjectRay prepared({to_double(ray.origin), to_double(ray.direction), kRayLength});
    Object object;
    double distance = kRayLength;
    FirstHit first;
    first.found = first_ray(snapshot_->objects, prepared, object, distance);
    first.id = object.id;
    first.distance = static_cast<float>(distance);
    return first;
  });
}

void Ours::forget_past() { scene_.forget_recent(); }

std::unique_ptr<Contender> batches_of(const Ours& ours) { return std::make_unique<Batches>(ours); }

}  // namespace locus::bench::dynamic
