#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/iterator/function_output_iterator.hpp>

#include "tests/bench/dynamic/id_map.h"
#include "tests/bench/dynamic/peers.h"
#include "tests/bench/dynamic/scalar_tests.h"

namespace locus::bench::dynamic {
namespace {

namespace index = boost::geometry::index;
using Point = boost::geometry::model::point<float, 3, boost::geometry::cs::cartesian>;
using Box = boost::geometry::model::box<Point>;
using Value = std::pair<Point, uint32_t>;
using Tree = index::rtree<Value, index::linear<16>>;

// Radius of all objects; the tree stores their centres, so query regions are grown by the radius.
constexpr float kRadius = 0.5f;

Point point_of(Vec3f v) { return {v.x, v.y, v.z}; }

class BoostTree : public Contender {
 public:
  BoostTree() : Contender("boost_rtree") {}
  bool does(Task task) const override { return task != Task::kRay; }

  void load(const Objects& objects) override {
    map_ = std::make_unique<IdMap>(objects.ids);
    bodies_ = bodies_of(objects);
    std::vector<Value> values;
    values.reserve(bodies_.size());
    for (uint32_t i = 0; i < bodies_.size(); ++i) values.push_back(value_of(i));
    tree_ = Tree(values.begin(), values.end());
  }
  void move(const Moves& moves) override {
    for (size_t i = 0; i < moves.ids.size(); ++i) {
      const uint32_t number = map_->number_of(moves.ids[i]);
      tree_.remove(value_of(number));
      bodies_[number].position = point_at(moves.positions, i);
      tree_.insert(value_of(number));
    }
  }
  void remove(absl::Span<const uint64_t> ids) override {
    for (const uint64_t id : ids) tree_.remove(value_of(map_->remove(id)));
  }
  void insert(const Objects& objects) override {
    for (size_t i = 0; i < objects.ids.size(); ++i) {
      const uint32_t number = map_->insert(objects.ids[i]);
      bodies_[number] = body_at(objects, i);
      tree_.insert(value_of(number));
    }
  }
  void balls(absl::Span<const Vec3f> centers, Answers& answers) override {
    each_region(centers, answers,
                [&](Vec3f center, std::vector<uint64_t>& ids) { collect(center, ids, scalar_ball_meets); });
  }
  void boxes(absl::Span<const Vec3f> centers, Answers& answers) override {
    each_region(centers, answers,
                [&](Vec3f center, std::vector<uint64_t>& ids) { collect(center, ids, scalar_box_meets); });
  }
  void nearest(absl::Span<const Vec3f> centers, Answers& answers) override {
    for (const Vec3f& center : centers) {
      NearestFound found;
      const auto take = [&](const Value& value) {
        const Body& body = bodies_[value.second];
        found.offer(squared_length(body.position - center), body.id);
      };
      tree_.query(index::nearest(point_of(center), kNearestCount), boost::make_function_output_iterator(take));
      found.append_to(answers, [](float squared) { return surface_distance(squared, kRadius); });
    }
  }

 private:
  Value value_of(uint32_t number) const { return {point_of(bodies_[number].position), number}; }
  template <class Meets>
  void collect(Vec3f center, std::vector<uint64_t>& ids, const Meets& meets) const {
    constexpr float kGrown = kReach + kRadius;
    const Vec3f reach = {kGrown, kGrown, kGrown};
    const auto take = [&](const Value& value) {
      const Body& body = bodies_[value.second];
      if (meets(body.position, body.radius, center)) ids.push_back(body.id);
    };
    tree_.query(index::intersects(Box(point_of(center - reach), point_of(center + reach))),
                boost::make_function_output_iterator(take));
  }

  std::unique_ptr<IdMap> map_;
  std::vector<Body> bodies_;
  Tree tree_;
};

}  // namespace

std::unique_ptr<Contender> boost_rtree() { return std::make_unique<BoostTree>(); }

}  // namespace locus::bench::dynamic
