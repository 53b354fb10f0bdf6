#include "tests/bench/dynamic/ours.h"

#include <array>

#include "core/base/check.h"
#include "core/geometry/shape.h"
#include "core/index/hash_grid/region_walk.h"
#include "core/index/regions.h"
#include "tests/support/run_batch.h"

namespace locus::bench::dynamic {
namespace {

// Returns a visitor for GridSnapshot. It appends to `ids` the ids of the objects for which meets() is true.
template <class Meets>
auto collector(const Meets& meets, std::vector<uint64_t>& ids) {
  return [meets, &ids](const GridRef& object) {
    if (meets(shape_of(object))) ids.push_back(object.entry().id);
    return true;
  };
}

// Returns the first hit up to kRayLength; of two hits at one distance, the one with the lower id.
FirstHit first_of(const SceneSnapshot& snapshot, const ObjectRay& ray) {
  Work work;
  double nearest = kRayLength;
  FirstHit first;
  snapshot.objects.grid().visit_ray(
      ray.slabs(), [&nearest] { return nearest; }, work,
      [&](const GridRef& object) {
        const std::optional<ShapeHit> hit = ray_hit(ray, shape_of(object));
        const uint64_t id = object.entry().id;
        if (!hit || hit->t > nearest || (hit->t == nearest && (!first.found || first.id < id))) return true;
        nearest = hit->t;
        first = {id, static_cast<float>(nearest), true};
        return true;
      });
  return first;
}

// The kNearestCount nearest objects, by (distance, id).
class NearestObjects {
 public:
  double limit() const { return limit_; }
  void offer(double distance, uint64_t id) {
    const std::pair<double, uint64_t> found = {distance, id};
    if (count_ == kNearestCount && !(found < found_[kNearestCount - 1])) return;
    size_t at = count_ < kNearestCount ? count_++ : kNearestCount - 1;
    for (; at > 0 && found < found_[at - 1]; --at) found_[at] = found_[at - 1];
    found_[at] = found;
    if (count_ == kNearestCount) limit_ = squared_limit(found_[kNearestCount - 1].first);
  }
  void append_to(Answers& answers) const {
    answers.counts.push_back(static_cast<uint32_t>(count_));
    for (size_t i = 0; i < count_; ++i) {
      answers.distances.push_back(static_cast<float>(found_[i].first));
      answers.ids.push_back(found_[i].second);
    }
  }

 private:
  std::array<std::pair<double, uint64_t>, kNearestCount> found_;
  size_t count_ = 0;
  double limit_ = std::numeric_limits<double>::infinity();
};

absl::Span<const float> numbers_of(const Vec3f& first, size_t count) {
  static_assert(sizeof(Vec3f) == 3 * sizeof(float));
  return {&first.x, 3 * count};
}

class Batches : public Contender {
 public:
  Batches(const Ours& ours, std::optional<AsOf> time, float reach)
      : Contender("ours_batch"), ours_(ours), time_(time), reach_(reach) {}
  bool does(Task task) const override { return task != Task::kMove && task != Task::kReinsert; }
  void load(const Objects&) override {}
  void move(const Moves&) override {}

  void balls(absl::Span<const Vec3f> centers, Answers& answers) override {
    BallColumns columns;
    columns.centers = numbers_of(centers.front(), centers.size());
    columns.radii = absl::MakeConstSpan(&reach_, 1);
    ask(columns, answers);
  }
  void boxes(absl::Span<const Vec3f> centers, Answers& answers) override {
    const std::array<float, 3> half = {reach_, reach_, reach_};
    BoxColumns columns;
    columns.centers = numbers_of(centers.front(), centers.size());
    columns.half_extents = half;
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
    const test::BlockResult result = run(columns, {Column::kId, Column::kT});
    for (size_t i = 0; i < rays.size(); ++i) {
      answers.counts.push_back(result.ids[i] != kNoId ? 1 : 0);
      if (result.ids[i] == kNoId) continue;
      answers.ids.push_back(result.ids[i]);
      answers.distances.push_back(result.t[i]);
    }
  }
  void nearest(absl::Span<const Vec3f> centers, Answers& answers) override {
    NearestColumns columns;
    columns.points = numbers_of(centers.front(), centers.size());
    columns.count = kNearestCount;
    const test::BlockResult result = run(columns, {Column::kId, Column::kT});
    append(result, answers);
    answers.distances.insert(answers.distances.end(), result.t.begin(), result.t.end());
  }

 private:
  template <class Columns>
  test::BlockResult run(const Columns& columns, ColumnSet wanted) const {
    QueryBatch batch;
    batch.max_reply_bytes = limits::kMaxReplyBytes;
    QueryBlock& block = batch.blocks.emplace_back();
    block.columns = wanted;
    block.max_results = limits::kMaxMaxResults;
    block.kind = columns;
    if (time_) {
      block.as_of_ticks = absl::MakeConstSpan(&time_->tick, 1);
      block.as_of_fractions = absl::MakeConstSpan(&time_->fraction, 1);
    }
    const absl::Status checked = check_batch(batch);
    LOCUS_CHECK_EQ(checked, absl::OkStatus());
    absl::StatusOr<test::BatchResult> result = test::run_batch(*ours_.latest(), batch, {});
    LOCUS_CHECK_EQ(result.status(), absl::OkStatus());
    return std::move(result->blocks.front());
  }
  template <class Columns>
  void ask(const Columns& columns, Answers& answers) const {
    append(run(columns, {Column::kId}), answers);
  }
  static void append(const test::BlockResult& result, Answers& answers) {
    answers.ids.insert(answers.ids.end(), result.ids.begin(), result.ids.end());
    answers.counts.insert(answers.counts.end(), result.counts.begin(), result.counts.end());
  }

  const Ours& ours_;
  const std::optional<AsOf> time_;
  const float reach_;
  std::vector<Vec3f> origins_, directions_;
};

SceneSpec spec_with(const HistoryOptions& history) {
  SceneSpec spec;
  spec.history = history;
  return spec;
}

}  // namespace

Ours::Ours(const HistoryOptions& history)
    : Contender("locus"), scene_("bench", spec_with(history), 1, StaticSet::empty()) {}

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
  batch.tick = ++tick_;
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

// Answers balls or boxes as the query engine does: one after the other, or all in one walk of the grid if that is
// faster. `region_of(center)` returns the region of a query. `meets_of(center)` returns a predicate that tests whether
// the query's ball or box intersects an object.
template <class RegionOf, class MeetsOf>
void Ours::ask_regions(absl::Span<const Vec3f> centers, Answers& answers, const RegionOf& region_of,
                       const MeetsOf& meets_of) {
  Work work;
  if (!RegionWalk::pays(snapshot_->objects.grid())) {
    each_region(centers, answers, [&](Vec3f center, std::vector<uint64_t>& ids) {
      region_of(center).visit(work, collector(meets_of(center), ids));
    });
    return;
  }
  RegionWalk walk(0, centers.size(), [&](size_t i) { return region_of(centers[i]); });
  each_region(centers, answers,
              [&](Vec3f center, std::vector<uint64_t>& ids) { walk.visit(work, collector(meets_of(center), ids)); });
}

void Ours::balls(absl::Span<const Vec3f> centers, Answers& answers) {
  const auto ball_at = [](Vec3f center) { return Balld{to_double(center), kReach}; };
  const auto region_of = [&](Vec3f center) {
    const Balld ball = ball_at(center);
    return GridRegion{&snapshot_->objects.grid(), BallRegion<double>(ball).bounds(), ball};
  };
  ask_regions(centers, answers, region_of, [&](Vec3f center) {
    return [ball = ball_at(center)](const Shape& shape) { return ball_overlaps(ball, shape); };
  });
}

void Ours::boxes(absl::Span<const Vec3f> centers, Answers& answers) {
  const auto box_at = [](Vec3f center) { return Obbd{to_double(center), {kReach, kReach, kReach}, {}}; };
  const auto region_of = [&](Vec3f center) {
    return GridRegion{&snapshot_->objects.grid(), BoxRegion<double>(box_at(center)).bounds(), {}};
  };
  ask_regions(centers, answers, region_of, [&](Vec3f center) {
    return [box = box_at(center)](const Shape& shape) { return box_overlaps(box, shape); };
  });
}

void Ours::rays(absl::Span<const Rayf> rays, Answers& answers) {
  each_ray(rays, answers, [&](const Rayf& ray) {
    return first_of(*snapshot_, ObjectRay({to_double(ray.origin), to_double(ray.direction), kRayLength}));
  });
}

void Ours::nearest(absl::Span<const Vec3f> centers, Answers& answers) {
  for (const Vec3f& center : centers) {
    const Vec3d point = to_double(center);
    Work work;
    NearestObjects found;
    snapshot_->objects.grid().visit_nearest(
        point, [&found] { return found.limit(); }, work,
        [&](const GridRef& object) {
          found.offer(distance(point, shape_of(object)), object.entry().id);
          return true;
        });
    found.append_to(answers);
  }
}

void Ours::forget_past() { scene_.forget_recent(); }

std::unique_ptr<Contender> batches_of(const Ours& ours, std::optional<AsOf> time, float reach) {
  return std::make_unique<Batches>(ours, time, reach);
}

}  // namespace locus::bench::dynamic
