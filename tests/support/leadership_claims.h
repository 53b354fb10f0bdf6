// Record of which daemon believed to lead which scene, with which token, and from when to when its lease allowed to
// claim that, in simulated time. fault() returns the first contradiction: two daemons that could claim the same scene
// at one moment, a token that two daemons had, or a claim with a lower token after one with a higher token. One thread
// at a time.
#ifndef LOCUS_TESTS_SUPPORT_LEADERSHIP_CLAIMS_H_
#define LOCUS_TESTS_SUPPORT_LEADERSHIP_CLAIMS_H_

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/cluster/scene_lease.h"

namespace locus::test {

class LeadershipClaims {
 public:
  using Time = server::ClusterTime;
  using Lease = std::shared_ptr<const server::SceneLease>;

  // `clock` is the variable that the clock of the leases returns. It is changed during calls only.
  explicit LeadershipClaims(Time& clock) : clock_(clock) {}

  // Records that the daemon began to lead at the present time.
  void begin(uint64_t daemon, const Lease& lease) {
    open_[daemon].push_back({daemon, lease->scene(), 0, clock_, allowed_until(*lease), lease});
  }
  // Records that the daemon stopped leading at the present time.
  void end(uint64_t daemon, SceneKey scene, server::Token token) {
    for (Claim& claim : open_[daemon])
      if (claim.scene == scene && claim.lease->token() == token) claim.until = std::min(claim.until, clock_);
  }
  // Records that the daemon ended, with all of its claims.
  void end_all(uint64_t daemon) {
    for (Claim& claim : open_[daemon]) {
      claim.until = std::min(claim.until, clock_);
      close(std::move(claim));
    }
    open_[daemon].clear();
  }
  // Updates the claims of a daemon to the state of its leases. Call after each of its steps.
  void update(uint64_t daemon) {
    std::vector<Claim> still;
    for (Claim& claim : open_[daemon]) {
      if (claim.lease->state() == server::SceneLease::State::kStopped) {
        claim.until = std::min(claim.until, clock_);
        close(std::move(claim));
        continue;
      }
      const Time until = allowed_until(*claim.lease);
      if (until > claim.until && clock_ > claim.until) {  // the lease had expired
        Claim renewed = claim;
        close(std::move(claim));
        renewed.from = clock_;
        renewed.until = until;
        still.push_back(std::move(renewed));
      } else {
        claim.until = std::max(claim.until, until);
        still.push_back(std::move(claim));
      }
    }
    open_[daemon] = std::move(still);
  }

  // Ends all claims and returns the first contradiction, or an empty string. Call it once, at the end.
  std::string fault() {
    for (auto& [daemon, claims] : open_) {
      for (Claim& claim : claims) close(std::move(claim));
      claims.clear();
    }
    for (auto& [scene, claims] : closed_) {
      std::sort(claims.begin(), claims.end(), [](const Claim& a, const Claim& b) { return a.from < b.from; });
      std::map<server::Token, uint64_t> owners;
      const Claim* before = nullptr;
      for (const Claim& claim : claims) {
        if (owners.emplace(claim.token, claim.daemon).first->second != claim.daemon)
          return absl::StrCat("two daemons led scene ", scene, " with token ", claim.token);
        if (before != nullptr && claim.token < before->token)
          return absl::StrCat("scene ", scene, " was led with token ", claim.token, " after ", before->token);
        if (before != nullptr && before->daemon != claim.daemon && claim.from < before->until)
          return absl::StrCat("scene ", scene, " was led by daemon ", before->daemon, " and by daemon ", claim.daemon,
                              " at once");
        if (before == nullptr || before->until < claim.until) before = &claim;
      }
    }
    return "";
  }

 private:
  struct Claim {
    uint64_t daemon = 0;
    SceneKey scene = 0;
    server::Token token = 0;  // when the claim was closed
    Time from, until;
    Lease lease;
  };

  // Returns the end of the time for which the lease allows claims, unless it is changed.
  Time allowed_until(const server::SceneLease& lease) {
    const Time now = std::exchange(clock_, std::max(clock_, lease.member().expires()));
    const bool living = lease.living();
    const Time end = living ? Time::max() : std::max(now, lease.member().expires());
    clock_ = now;
    return lease.state() == server::SceneLease::State::kStopped ? now : end;
  }
  void close(Claim claim) {
    claim.token = claim.lease->token();  // it may have been raised
    if (claim.from < claim.until) closed_[claim.scene].push_back(std::move(claim));
  }

  Time& clock_;
  std::map<uint64_t, std::vector<Claim>> open_;
  std::map<SceneKey, std::vector<Claim>> closed_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_LEADERSHIP_CLAIMS_H_
