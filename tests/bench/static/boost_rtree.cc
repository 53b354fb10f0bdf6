#include "tests/bench/static/boost_rtree.h"

#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/iterator/function_output_iterator.hpp>

#include "tests/bench/static/scalar_overlap.h"

namespace locus::bench {
namespace {

namespace index = boost::geometry::index;
using Point = boost::geometry::model::point<float, 3, boost::geometry::cs::cartesian>;
using Box = boost::geometry::model::box<Point>;
using Value = std::pair<Box, uint32_t>;

Box box_of(const Aabbf& bounds) {
  return {Point(bounds.min.x, bounds.min.y, bounds.min.z), Point(bounds.max.x, bounds.max.y, bounds.max.z)};
}

class BoostRtree : public Peer {
 public:
  explicit BoostRtree(const BenchMesh& mesh) : Peer("boost_rtree"), triangles_(mesh.triangles) {
    std::vector<Value> values;
    values.reserve(triangles_.size());
    for (const Triangle& triangle : triangles_) values.emplace_back(box_of(bounds_of(triangle)), triangle.number);
    tree_ = Tree(values.begin(), values.end());
  }
  bool does(Task task) const override { return task == Task::kBall || task == Task::kBox; }
  bool slow() const override { return true; }

  void ball_ids(absl::Span<const Ballf> balls, absl::Span<uint32_t> ids, uint32_t* counts) override {
    for (const Ballf& ball : balls) {
      const auto test = [&](const Triangle& triangle) {
        return scalar_squared_distance(ball.center, triangle) <= ball.radius * ball.radius;
      };
      const Vec3f reach = {ball.radius, ball.radius, ball.radius};
      *counts++ = collect({ball.center - reach, ball.center + reach}, ids.data(), test);
    }
  }
  void box_ids(absl::Span<const Obbf> boxes, absl::Span<uint32_t> ids, uint32_t* counts) override {
    for (const Obbf& box : boxes) {
      const auto test = [&](const Triangle& triangle) { return scalar_box_overlaps(box.center, box.half, triangle); };
      *counts++ = collect(ends_of(box), ids.data(), test);
    }
  }

 private:
  using Tree = index::rtree<Value, index::rstar<16>>;

  template <class Test>
  uint32_t collect(const Aabbf& bounds, uint32_t* ids, const Test& test) const {
    uint32_t count = 0;
    const auto take = [&](const Value& value) {
      if (test(triangles_[value.second])) ids[count++] = value.second;
    };
    tree_.query(index::intersects(box_of(bounds)), boost::make_function_output_iterator(take));
    return count;
  }

  const std::vector<Triangle>& triangles_;
  Tree tree_;
};

}  // namespace

void add_boost_peer(const BenchMesh& mesh, Needs needs, Peers& peers) {
  if (needs.regions) peers.push_back(std::make_unique<BoostRtree>(mesh));
}

}  // namespace locus::bench
