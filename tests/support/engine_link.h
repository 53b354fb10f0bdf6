// Connection of one simulated daemon to the engine, on which calls take simulated time and fail: they time out, are not
// answered although the engine has executed them, or are executed long after the caller has given up. The owner decides
// the outcome of each call. As many threads as the functions of the owner allow.
#ifndef LOCUS_TESTS_SUPPORT_ENGINE_LINK_H_
#define LOCUS_TESTS_SUPPORT_ENGINE_LINK_H_

#include <functional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "server/cluster/cluster_engine.h"

namespace locus::test {

// Outcome of a call.
enum class CallFate : uint8_t {
  kAnswered,
  kLost,   // executed, but the answer is lost
  kLate,   // executed later; there is no answer
  kNever,  // not executed
};

enum class CallKind : uint8_t { kBeat, kOtherWrite, kRead };

class EngineLink : public server::ClusterEngine {
 public:
  // Function that is called before each call and returns its fate.
  using Judge = std::function<CallFate(CallKind)>;
  // Function that executes a statement later.
  using Postpone = std::function<void(std::function<void()>)>;
  // Function that is called after a call, and lets its time pass.
  using Done = std::function<void(CallKind, CallFate)>;

  EngineLink(server::ClusterEngine& engine, Judge judge, Postpone postpone, Done done)
      : engine_(engine), judge_(std::move(judge)), postpone_(std::move(postpone)), done_(std::move(done)) {}

  absl::Status join(server::MemberId id, const server::MemberInfo& info, uint64_t load) override {
    return call<absl::Status>(CallKind::kOtherWrite, [=, &engine = engine_] { return engine.join(id, info, load); });
  }
  absl::StatusOr<server::BeatReply> beat(server::MemberId id, uint64_t load, size_t watched) override {
    return call<absl::StatusOr<server::BeatReply>>(CallKind::kBeat,
                                                   [=, &engine = engine_] { return engine.beat(id, load, watched); });
  }
  absl::StatusOr<bool> mark_dead(server::SeenBeat seen) override {
    return call<absl::StatusOr<bool>>(CallKind::kOtherWrite, [=, &engine = engine_] { return engine.mark_dead(seen); });
  }
  absl::Status leave(server::MemberId id) override {
    return call<absl::Status>(CallKind::kOtherWrite, [=, &engine = engine_] { return engine.leave(id); });
  }
  absl::Status forget(server::MemberId id) override {
    return call<absl::Status>(CallKind::kOtherWrite, [=, &engine = engine_] { return engine.forget(id); });
  }
  absl::StatusOr<std::vector<server::MemberRow>> members() override {
    return call<absl::StatusOr<std::vector<server::MemberRow>>>(CallKind::kRead,
                                                                [&engine = engine_] { return engine.members(); });
  }
  absl::StatusOr<std::vector<server::LeaderRow>> scenes_led_by(server::MemberId leader) override {
    return call<absl::StatusOr<std::vector<server::LeaderRow>>>(
        CallKind::kRead, [=, &engine = engine_] { return engine.scenes_led_by(leader); });
  }
  absl::StatusOr<std::vector<server::LeaderRow>> scenes_without_leader() override {
    return call<absl::StatusOr<std::vector<server::LeaderRow>>>(
        CallKind::kRead, [&engine = engine_] { return engine.scenes_without_leader(); });
  }
  absl::StatusOr<server::LeaderRow> take_over(SceneKey scene, server::Token seen, server::MemberId to) override {
    return call<absl::StatusOr<server::LeaderRow>>(
        CallKind::kOtherWrite, [=, &engine = engine_] { return engine.take_over(scene, seen, to); });
  }
  absl::StatusOr<server::LeaderRow> hand_over(SceneKey scene, server::Token token, server::MemberId from,
                                              server::MemberId to) override {
    return call<absl::StatusOr<server::LeaderRow>>(
        CallKind::kOtherWrite, [=, &engine = engine_] { return engine.hand_over(scene, token, from, to); });
  }

 private:
  template <class Result, class Statement>
  Result call(CallKind kind, Statement statement) {
    const CallFate fate = judge_(kind);
    Result result = absl::UnavailableError("the engine does not answer");
    switch (fate) {
      case CallFate::kAnswered:
        result = statement();
        break;
      case CallFate::kLost:
        (void)statement();
        break;
      case CallFate::kLate:
        postpone_([statement] { (void)statement(); });
        break;
      case CallFate::kNever:
        break;
    }
    done_(kind, fate);
    return result;
  }

  server::ClusterEngine& engine_;
  const Judge judge_;
  const Postpone postpone_;
  const Done done_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_ENGINE_LINK_H_
