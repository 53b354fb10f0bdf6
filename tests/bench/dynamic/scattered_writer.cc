#include "tests/bench/dynamic/scattered_writer.h"

#include "core/base/check.h"

namespace locus::bench::dynamic {
namespace {

constexpr size_t kStride = 7919;

std::vector<float> scattered(absl::Span<const float> points) {
  const size_t count = points.size() / 3;
  std::vector<float> result;
  result.reserve(points.size());
  for (size_t i = 0; i < count; ++i) {
    const size_t from = i * kStride % count;
    result.insert(result.end(), {points[3 * from], points[3 * from + 1], points[3 * from + 2]});
  }
  return result;
}

}  // namespace

ScatteredWriter::ScatteredWriter(World& world) {
  const absl::Span<const uint64_t> ids = world.objects().ids;
  LOCUS_CHECK_NE(ids.size() % kStride, size_t{0});
  for (size_t i = 0; i < ids.size(); ++i) ids_.push_back(ids[i * kStride % ids.size()]);
  positions_[1] = scattered(world.objects().positions);
  world.step();
  positions_[0] = scattered(world.objects().positions);
  velocities_ = scattered(world.moves().velocities);
}

void ScatteredWriter::move(Contender& contender, size_t batch) {
  LOCUS_CHECK_EQ(ids_.size() % batch, size_t{0});
  Moves moves;
  moves.ids = absl::MakeConstSpan(ids_).subspan(next_, batch);
  moves.positions = absl::MakeConstSpan(positions_[turn_]).subspan(3 * next_, 3 * batch);
  moves.velocities = absl::MakeConstSpan(velocities_).subspan(3 * next_, 3 * batch);
  contender.move(moves);
  next_ += batch;
  if (next_ < ids_.size()) return;
  next_ = 0;
  turn_ = 1 - turn_;
}

}  // namespace locus::bench::dynamic
