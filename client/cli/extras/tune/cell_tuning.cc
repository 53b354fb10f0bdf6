#include "client/cli/extras/tune/cell_tuning.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/extras/tune/query_turns.h"
#include "client/cli/extras/tune/scratch_scenes.h"
#include "core/base/check.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

// Maximum number of scratch scenes at the same time: the present size, the server's choice, the best and three others.
constexpr size_t kAtOnce = 6;

int exponent_of(double cell_size) { return static_cast<int>(std::lround(std::log2(cell_size))); }

class CellTuning {
 public:
  CellTuning(const client::Client& work, const client::Client& cleaner, const v1::GetSceneResponse& scene,
             const ObjectBatches& objects, const QuerySet& queries, const CellTuningOptions& options,
             ProgressWriter& progress)
      : work_(work),
        scratches_(work, cleaner, scene.scene()),
        scene_(scene),
        objects_(objects),
        queries_(queries),
        options_(options),
        progress_(progress) {}

  absl::StatusOr<CellTuningResult> run() {
    RETURN_IF_ERROR(make_first());
    std::vector<int> next = first_sizes();
    while (!next.empty()) {
      RETURN_IF_ERROR(measure_sizes(next));
      next = options_.sizes.empty() ? next_exponents(times(), present().exponent) : std::vector<int>();
    }
    RETURN_IF_ERROR(confirm());
    return result();
  }

 private:
  struct Candidate {
    int exponent = 0;
    SizeFigures figures;
    std::string scene;  // empty if there is none now
  };

  const Candidate& present() const { return candidates_[present_]; }

  absl::StatusOr<size_t> make(double setting) {
    progress_.begin(
        {.action = "building",
         .subject = setting == 0 ? "with the server's cell size" : absl::StrCat("with cell size ", setting)});
    ASSIGN_OR_RETURN(const ScratchScene scratch, scratches_.make(setting, objects_));
    Candidate candidate;
    candidate.exponent = exponent_of(scratch.cell_size);
    candidate.scene = scratch.name;
    candidate.figures.setting = setting;
    candidate.figures.cell_size = scratch.cell_size;
    candidate.figures.build_ms = scratch.build_ms;
    candidate.figures.bytes = scratch.bytes;
    candidate.figures.is_confirmed = false;
    candidates_.push_back(std::move(candidate));
    return candidates_.size() - 1;
  }

  // Makes a scene with the server's choice and, if the scene has another cell size now, one with the present size.
  absl::Status make_first() {
    ASSIGN_OR_RETURN(present_, make(0));
    const double now = scene_.description().objects().cell_size();
    if (now > 0 && candidates_[present_].figures.cell_size != now) {
      ASSIGN_OR_RETURN(present_, make(now));
    }
    candidates_[present_].figures.is_present = true;
    return absl::OkStatus();
  }

  bool is_known(int exponent) const {
    return std::any_of(candidates_.begin(), candidates_.end(),
                       [exponent](const Candidate& candidate) { return candidate.exponent == exponent; });
  }

  std::vector<int> first_sizes() const {
    if (options_.sizes.empty()) return next_exponents({}, present().exponent);
    std::vector<int> exponents;
    for (const double size : options_.sizes) exponents.push_back(exponent_of(size));
    return exponents;
  }

  std::map<int, double> times() const {
    std::map<int, double> times;
    for (const Candidate& candidate : candidates_) times[candidate.exponent] = candidate.figures.relative;
    return times;
  }

  // Measures the sizes in groups, each together with the present size. The first group also has the server's choice.
  absl::Status measure_sizes(const std::vector<int>& exponents) {
    std::vector<size_t> group = measured_ ? std::vector<size_t>{present_} : made();
    for (const int exponent : exponents) {
      if (is_known(exponent)) continue;
      if (made().size() >= kAtOnce) {
        RETURN_IF_ERROR(measure(group, options_.rounds));
        RETURN_IF_ERROR(remove_others());
        group = {present_};
      }
      ASSIGN_OR_RETURN(const size_t index, make(std::ldexp(1.0, exponent)));
      group.push_back(index);
    }
    if (group.size() > 1 || !measured_) RETURN_IF_ERROR(measure(group, options_.rounds));
    return remove_others();
  }

  // Measures the best size and the server's choice again, which removes the luck of the best. Only these are named.
  absl::Status confirm() {
    std::vector<size_t> group = {present_};
    for (const size_t index : {best(), size_t{0}})
      if (std::find(group.begin(), group.end(), index) == group.end()) group.push_back(index);
    if (group.size() > 1) RETURN_IF_ERROR(measure(group, 2 * options_.rounds));
    for (const size_t index : group) candidates_[index].figures.is_confirmed = true;
    return absl::OkStatus();
  }

  std::vector<size_t> made() const {
    std::vector<size_t> made;
    for (size_t i = 0; i < candidates_.size(); ++i)
      if (!candidates_[i].scene.empty()) made.push_back(i);
    return made;
  }

  size_t best() const {
    const auto faster = [](const Candidate& a, const Candidate& b) { return a.figures.relative < b.figures.relative; };
    return static_cast<size_t>(std::min_element(candidates_.begin(), candidates_.end(), faster) - candidates_.begin());
  }

  // Removes all scratch scenes but those of the present size, the server's choice and the best.
  absl::Status remove_others() {
    const size_t keep = best();
    for (size_t i = 1; i < candidates_.size(); ++i) {
      if (i == present_ || i == keep || candidates_[i].scene.empty()) continue;
      RETURN_IF_ERROR(scratches_.remove(std::exchange(candidates_[i].scene, "")));
    }
    return absl::OkStatus();
  }

  absl::Status measure(const std::vector<size_t>& group, int rounds) {
    std::vector<std::string> scenes;
    for (const size_t index : group) scenes.push_back(candidates_[index].scene);
    progress_.begin({.action = "measuring",
                     .subject = absl::StrCat(group.size(), " cell sizes in turns"),
                     .unit = "rounds",
                     .total = static_cast<uint64_t>(rounds)});
    ASSIGN_OR_RETURN(const std::vector<KindCosts> costs,
                     ask_in_turns(work_, scenes, queries_, rounds,
                                  [this](int done) { progress_.update(static_cast<uint64_t>(done)); }));
    size_t base = 0;
    while (group[base] != present_) ++base;
    if (weights_.empty()) weights_ = weights_of(costs[base]);
    const double time = std::max(weighted_time(costs[base], weights_), 1e-9);
    for (size_t i = 0; i < group.size(); ++i) {
      candidates_[group[i]].figures.kinds = costs[i];
      candidates_[group[i]].figures.relative = i == base ? 1 : weighted_time(costs[i], weights_) / time;
    }
    measured_ = true;
    return absl::OkStatus();
  }

  KindWeights weights_of(const KindCosts& costs) const {
    if (options_.mix == Mix::kAlike) return equal_weights(costs);
    KindWeights weights;
    for (const auto& [kind, count] : queries_.counts()) weights[kind] = static_cast<double>(count);
    return weights;
  }

  CellTuningResult result() const {
    CellTuningResult result;
    for (const Candidate& candidate : candidates_) result.figures.push_back(candidate.figures);
    std::stable_sort(result.figures.begin(), result.figures.end(),
                     [](const SizeFigures& a, const SizeFigures& b) { return a.cell_size < b.cell_size; });
    result.choice = choose_size(result.figures, scene_.scene().spec().cell_size());
    return result;
  }

  const client::Client& work_;
  ScratchScenes scratches_;
  const v1::GetSceneResponse& scene_;
  const ObjectBatches& objects_;
  const QuerySet& queries_;
  const CellTuningOptions& options_;
  ProgressWriter& progress_;
  std::vector<Candidate> candidates_;  // the first is the server's choice
  size_t present_ = 0;
  bool measured_ = false;  // whether the first candidates were measured
  KindWeights weights_;
};

}  // namespace

ScratchNeed scratch_need(const v1::GetSceneResponse& scene, const CellTuningOptions& options) {
  const uint64_t scenes = options.sizes.empty() ? kAtOnce : std::min(kAtOnce, options.sizes.size() + 2);
  return {scenes, scenes * scene.scene().objects(), scenes * scene.description().objects().bytes()};
}

absl::StatusOr<CellTuningResult> tune_cells(const client::Client& work, const client::Client& cleaner,
                                            const v1::GetSceneResponse& scene, const ObjectBatches& objects,
                                            const QuerySet& queries, const CellTuningOptions& options,
                                            ProgressWriter& progress) {
  LOCUS_CHECK_NE(objects.objects(), 0u);
  return CellTuning(work, cleaner, scene, objects, queries, options, progress).run();
}

}  // namespace locus::cli
