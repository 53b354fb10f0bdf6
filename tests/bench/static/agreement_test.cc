#include "tests/bench/static/agreement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/geometry/triangle_overlap.h"
#include "tests/bench/frame/report.h"
#include "tests/bench/static/ours.h"
#include "tests/bench/static/ray_cases.h"
#include "tests/bench/static/region_cases.h"
#include "tests/bench/static/two_sheets.h"

namespace locus::bench {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// A peer that misses the first hit of each batch; all its other answers are right.
class Liar : public Peer {
 public:
  explicit Liar(const BenchMesh& mesh, std::string fault = "") : Peer("liar"), right_(mesh), fault_(std::move(fault)) {}
  bool does(Task) const override { return true; }
  std::string known_fault(Task) const override { return fault_; }
  void first(absl::Span<const RayQuery> rays, RayAnswer* answers) override {
    right_.first(rays, answers);
    RayAnswer* const hit = std::find_if(answers, answers + rays.size(),
                                        [](const RayAnswer& answer) { return answer.triangle != kNoTriangle; });
    if (hit != answers + rays.size()) *hit = RayAnswer{};
  }
  void any(absl::Span<const RayQuery> rays, uint8_t* answers) override {
    right_.any(rays, answers);
    if (uint8_t* const hit = std::find(answers, answers + rays.size(), 1); hit != answers + rays.size()) *hit = 0;
  }
  void ray_ids(absl::Span<const RayQuery> rays, absl::Span<uint32_t> ids, uint32_t* counts) override {
    right_.ray_ids(rays, ids, counts);
    if (counts[0] > 0) --counts[0];
  }
  void ball_ids(absl::Span<const Ballf> balls, absl::Span<uint32_t> ids, uint32_t* counts) override {
    right_.ball_ids(balls, ids, counts);
    if (counts[0] > 0) --counts[0];
  }
  void box_ids(absl::Span<const Obbf> boxes, absl::Span<uint32_t> ids, uint32_t* counts) override {
    right_.box_ids(boxes, ids, counts);
    if (counts[0] > 0) --counts[0];
  }

 private:
  Ours right_;
  std::string fault_;
};

class AgreementTest : public testing::Test {
 protected:
  AgreementTest() {
    options_.quick = true;
    options_.rounds = 1;
  }
  // Runs all cases of rays, balls and boxes that the filter selects.
  Report report_of(Peer& ours, std::unique_ptr<Peer> peer, const std::string& filter) {
    options_.filter = *CaseFilter::create(filter);
    Peers peers;
    peers.push_back(std::move(peer));
    Report report;
    const MeshRun run{options_, [](const std::string&) {}, mesh_, ours, peers, report};
    run_ray_cases(run);
    run_region_cases(run);
    return report;
  }

  const BenchMesh mesh_ = two_sheets();
  Options options_;
  Ours right_{mesh_};
};

TEST_F(AgreementTest, EqualAnswersAgreeWithoutANote) {
  const Report report = report_of(right_, std::make_unique<Ours>(mesh_), "");
  EXPECT_THAT(report.cells, SizeIs(12));
  EXPECT_THAT(report.notes, IsEmpty());
  EXPECT_THAT(report.disagreements, IsEmpty());
}

TEST_F(AgreementTest, AWrongFirstHitOfOursMakesTheExitStatusOne) {
  Liar ours(mesh_);
  const Report report = report_of(ours, std::make_unique<Ours>(mesh_), "ray/incoherent/first");
  ASSERT_THAT(report.disagreements, SizeIs(1));
  EXPECT_THAT(report.disagreements[0], HasSubstr("we are wrong about ray"));
  EXPECT_EQ(exit_status(report), 1);
}

TEST_F(AgreementTest, AWrongAnyHitOfOursMakesTheExitStatusOne) {
  Liar ours(mesh_);
  EXPECT_EQ(exit_status(report_of(ours, std::make_unique<Ours>(mesh_), "ray/incoherent/any")), 1);
}

TEST_F(AgreementTest, AMissingTriangleOfOursMakesTheExitStatusOne) {
  for (const char* filter : {"ray/incoherent/all", "ball/10", "box/10"}) {
    Liar ours(mesh_);
    const Report report = report_of(ours, std::make_unique<Ours>(mesh_), filter);
    ASSERT_FALSE(report.disagreements.empty()) << filter;
    EXPECT_THAT(report.disagreements[0], HasSubstr("we left out triangle"));
    EXPECT_EQ(exit_status(report), 1);
  }
}

TEST_F(AgreementTest, FewWrongRaysOfAPeerAreOnlyNoted) {
  const Report report = report_of(right_, std::make_unique<Liar>(mesh_), "ray/incoherent/first");
  ASSERT_THAT(report.notes, SizeIs(1));
  EXPECT_THAT(report.notes[0], HasSubstr("liar differs from us in 1 of 20000 rays"));
  EXPECT_EQ(exit_status(report), 0);
}

TEST_F(AgreementTest, ManyWrongIdsOfAPeerMakeTheExitStatusOne) {
  const Report report = report_of(right_, std::make_unique<Liar>(mesh_), "ball/10");
  ASSERT_THAT(report.disagreements, SizeIs(1));
  EXPECT_THAT(report.disagreements[0], HasSubstr("liar differs from us"));
  EXPECT_EQ(exit_status(report), 1);
}

TEST_F(AgreementTest, ANamedFaultIsNotedWithItsReason) {
  const Report report = report_of(right_, std::make_unique<Liar>(mesh_, "it drops the last one"), "ball/10");
  ASSERT_THAT(report.notes, SizeIs(1));
  EXPECT_THAT(report.notes[0], HasSubstr("known: it drops the last one"));
  EXPECT_EQ(exit_status(report), 0);
}

TEST_F(AgreementTest, MoreRaysThanAllowedAreADisagreement) {
  const std::vector<RayQuery> rays = random_rays(mesh_, 1000, 101, kEndless);
  std::vector<RayAnswer> ours(rays.size()), theirs(rays.size());
  right_.first(rays, ours.data());
  Report report;
  compare_first("case", mesh_, right_, Task::kFirst, asked_of(right_, rays), ours, theirs, report);
  ASSERT_THAT(report.disagreements, SizeIs(1));
  EXPECT_THAT(report.disagreements[0], HasSubstr("at most 1 are allowed"));
}

TEST_F(AgreementTest, HitsThatAreNearEachOtherAgree) {
  const std::vector<RayQuery> rays = random_rays(mesh_, 100, 101, kEndless);
  std::vector<RayAnswer> ours(rays.size());
  right_.first(rays, ours.data());
  std::vector<RayAnswer> theirs = ours;
  for (RayAnswer& answer : theirs) answer.t += 0.00005f * mesh_.diagonal;
  Report report;
  compare_first("case", mesh_, right_, Task::kFirst, asked_of(right_, rays), ours, theirs, report);
  EXPECT_THAT(report.notes, IsEmpty());
  EXPECT_THAT(report.disagreements, IsEmpty());
}

TEST_F(AgreementTest, ATriangleGivenTwiceIsADisagreement) {
  RegionTally tally;
  Report report;
  compare_ids(
      "case", {1, 1}, {1}, [](uint32_t) { return true; }, tally, report);
  ASSERT_FALSE(report.disagreements.empty());
  EXPECT_THAT(report.disagreements[0], HasSubstr("we gave a triangle twice"));
}

TEST_F(AgreementTest, SlowPeersGetSixteenOfEach128Queries) {
  class Slow : public Ours {
   public:
    using Ours::Ours;
    bool slow() const override { return true; }
  };
  const Asked<int> asked = asked_of(Slow(mesh_), std::vector<int>(256));
  ASSERT_EQ(asked.places.size(), 32u);
  EXPECT_EQ(asked.places.front(), 48u);
  EXPECT_EQ(asked.places[15], 63u);
  EXPECT_EQ(asked.places[16], 176u);
}

}  // namespace
}  // namespace locus::bench
