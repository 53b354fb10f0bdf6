#include "tests/bench/static/agreement.h"

#include <cmath>
#include <limits>

#include "absl/strings/str_format.h"
#include "core/geometry/ray_triangle.h"

namespace locus::bench {
namespace {

// Maximum number of triangle tests of one comparison; differing rays beyond this are counted but not tested.
constexpr size_t kMaxTests = 400'000'000;

RayAnswer by_every_triangle(const BenchMesh& mesh, const RayQuery& query) {
  const TriangleRay ray(to_double(query.origin), to_double(query.direction));
  RayAnswer nearest;
  for (const Triangle& triangle : mesh.triangles) {
    const std::optional<TriangleHit> hit = ray.hit(triangle);
    if (!hit) continue;
    const float t = ray.from_scaled(hit->t);
    if (t <= query.t_max && (nearest.triangle == kNoTriangle || t < nearest.t)) nearest = {t, triangle.number};
  }
  return nearest;
}

bool hits(const RayAnswer& answer) { return answer.triangle != kNoTriangle; }
bool hits(uint8_t answer) { return answer != 0; }

bool differ(const RayAnswer& a, const RayAnswer& b, double tolerance) {
  if (hits(a) != hits(b)) return true;
  return hits(a) && !(std::abs(double{a.t} - double{b.t}) <= tolerance);
}
bool differ(uint8_t a, uint8_t b, double) { return hits(a) != hits(b); }

bool right(const RayAnswer& answer, const RayAnswer& truth) {
  return answer.triangle == truth.triangle && (!hits(truth) || answer.t == truth.t);
}
bool right(uint8_t answer, const RayAnswer& truth) { return hits(answer) == hits(truth); }

std::string words(const RayAnswer& answer) { return hits(answer) ? absl::StrFormat("t = %.9g", answer.t) : "a miss"; }
std::string words(uint8_t answer) { return hits(answer) ? "a hit" : "a miss"; }

// Returns a sentence which says that `count` of `of` rays differ. `first` describes the first of them.
std::string difference(const std::string& case_name, const Peer& peer, size_t count, size_t of,
                       const std::string& first) {
  return absl::StrCat(case_name, ": ", peer.name(), " differs from us in ", count, " of ", of,
                      " rays; the first: ", first);
}

template <class Answer>
void compare_rays(const std::string& case_name, const BenchMesh& mesh, const Peer& peer, Task task,
                  const Asked<RayQuery>& asked, absl::Span<const Answer> ours, absl::Span<const Answer> theirs,
                  Report& report) {
  const double tolerance = kSameHit * double{mesh.diagonal};
  const size_t decided_at_most = std::max(kDifferingRays, kMaxTests / mesh.triangles.size());
  size_t count = 0;
  std::string first;
  for (size_t i = 0; i < asked.queries.size(); ++i) {
    const Answer& our = ours[asked.places[i]];
    if (!differ(our, theirs[i], tolerance)) continue;
    if (count == 0)
      first = absl::StrCat("ray ", asked.places[i], ", ", words(our), " by us, ", words(theirs[i]), " by it");
    if (++count > decided_at_most) continue;
    const RayAnswer truth = by_every_triangle(mesh, asked.queries[i]);
    if (!right(our, truth))
      report.disagreements.push_back(absl::StrCat(case_name, ": we are wrong about ray ", asked.places[i], ": ",
                                                  words(our), " by us, ", words(truth), " by asking every triangle"));
  }
  if (count == 0) return;
  const size_t allowed = (asked.queries.size() * kDifferingRays + kDifferingRaysOf - 1) / kDifferingRaysOf;
  const std::string sentence = difference(case_name, peer, count, asked.queries.size(), first);
  const std::string fault = peer.known_fault(task);
  if (count <= allowed)
    report.notes.push_back(sentence);
  else if (!fault.empty())
    report.notes.push_back(absl::StrCat(sentence, "; known: ", fault));
  else
    report.disagreements.push_back(absl::StrCat(sentence, "; at most ", allowed, " are allowed"));
}

}  // namespace

void compare_first(const std::string& case_name, const BenchMesh& mesh, const Peer& peer, Task task,
                   const Asked<RayQuery>& asked, absl::Span<const RayAnswer> ours, absl::Span<const RayAnswer> theirs,
                   Report& report) {
  compare_rays(case_name, mesh, peer, task, asked, ours, theirs, report);
}

void compare_any(const std::string& case_name, const BenchMesh& mesh, const Peer& peer, const Asked<RayQuery>& asked,
                 absl::Span<const uint8_t> ours, absl::Span<const uint8_t> theirs, Report& report) {
  compare_rays(case_name, mesh, peer, Task::kAny, asked, ours, theirs, report);
}

void report_tally(const std::string& case_name, const Peer& peer, Task task, const RegionTally& tally, Report& report) {
  if (tally.queries == 0) return;
  const std::string sentence = absl::StrCat(case_name, ": ", peer.name(), " differs from us in ", tally.ids, " ids of ",
                                            tally.queries, " queries; the first: ", tally.first_difference);
  const std::string fault = peer.known_fault(task);
  const auto allowed = static_cast<size_t>(std::ceil(kDifferingIds * static_cast<double>(tally.all_ids)));
  if (tally.ids <= allowed)
    report.notes.push_back(sentence);
  else if (!fault.empty())
    report.notes.push_back(absl::StrCat(sentence, "; known: ", fault));
  else
    report.disagreements.push_back(absl::StrCat(sentence, "; at most ", allowed, " are allowed"));
}

}  // namespace locus::bench
