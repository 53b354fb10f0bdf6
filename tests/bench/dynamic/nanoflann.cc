#include <nanoflann.hpp>

#include "tests/bench/dynamic/id_map.h"
#include "tests/bench/dynamic/peers.h"

namespace locus::bench::dynamic {
namespace {

// Radius of all objects; the tree stores their centres, so query balls are grown by the radius.
constexpr float kRadius = 0.5f;
constexpr size_t kLeafSize = 16;

// Set of points with the interface that nanoflann requires.
struct Points {
  std::vector<Vec3f> points;
  size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(size_t i, size_t axis) const { return points[i][static_cast<int>(axis)]; }
  template <class Bounds>
  bool kdtree_get_bbox(Bounds&) const {
    return false;
  }
};

class NanoflannTree : public Contender {
 public:
  NanoflannTree() : Contender("nanoflann"), tree_(3, points_, nanoflann::KDTreeSingleIndexAdaptorParams(kLeafSize)) {}
  bool does(Task task) const override { return task == Task::kMove || task == Task::kBall || task == Task::kNearest; }

  void load(const Objects& objects) override {
    map_ = std::make_unique<IdMap>(objects.ids);
    ids_.assign(objects.ids.begin(), objects.ids.end());
    points_.points.resize(ids_.size());
    for (size_t i = 0; i < ids_.size(); ++i) points_.points[i] = point_at(objects.positions, i);
    tree_.buildIndex();
  }
  void move(const Moves& moves) override {
    for (size_t i = 0; i < moves.ids.size(); ++i)
      points_.points[map_->number_of(moves.ids[i])] = point_at(moves.positions, i);
    tree_.buildIndex();
  }
  void balls(absl::Span<const Vec3f> centers, Answers& answers) override {
    constexpr float kGrown = kReach + kRadius;
    each_region(centers, answers, [&](Vec3f center, std::vector<uint64_t>& ids) {
      tree_.radiusSearch(&center.x, kGrown * kGrown, matches_, nanoflann::SearchParams(0, 0, false));
      for (const auto& match : matches_) ids.push_back(ids_[match.first]);
    });
  }
  void nearest(absl::Span<const Vec3f> centers, Answers& answers) override {
    std::array<uint32_t, kNearestCount> numbers{};
    std::array<float, kNearestCount> squared{};
    for (const Vec3f& center : centers) {
      const size_t found = tree_.knnSearch(&center.x, kNearestCount, numbers.data(), squared.data());
      answers.counts.push_back(static_cast<uint32_t>(found));
      for (size_t i = 0; i < found; ++i) {
        answers.ids.push_back(ids_[numbers[i]]);
        answers.distances.push_back(surface_distance(squared[i], kRadius));
      }
    }
  }

 private:
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Points>, Points, 3, uint32_t>;

  std::unique_ptr<IdMap> map_;
  std::vector<uint64_t> ids_;
  Points points_;
  Tree tree_;
  std::vector<std::pair<uint32_t, float>> matches_;
};

}  // namespace

std::unique_ptr<Contender> nanoflann_tree() { return std::make_unique<NanoflannTree>(); }

}  // namespace locus::bench::dynamic
