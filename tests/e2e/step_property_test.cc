// Random steps, each made in one scene as a step and in another as an update and then a query: acks, answers and errors
// are equal, and so are the scenes. Planted bugs in the step show that the comparison notices them.
#include <functional>
#include <string>

#include "absl/strings/str_cat.h"
#include "tests/support/random.h"
#include "tests/support/rpc_test.h"

namespace locus::test {
namespace {

// Outcome of a step, in the form in which both ways can be compared: without epochs.
struct StepOutcome {
  std::string error;  // of the whole step
  v1::UpdateAck ack;
  v1::QueryResult result;
  std::string query_error;

  std::string text() const {
    StepOutcome plain = *this;
    plain.ack.clear_epoch();
    plain.result.clear_epoch();
    return error + "\n" + plain.ack.DebugString() + plain.result.DebugString() + query_error;
  }
};

std::string debug_text(const v1::Error& error) { return error.DebugString(); }

class StepPropertyTest : public RpcTest {
 protected:
  using Step = std::function<StepOutcome(const v1::UpdateBatch&, const v1::QueryBatch&)>;
  static constexpr uint64_t kIds = 12;

  void SetUp() override {
    v1::SceneSpec spec;
    spec.set_history_ticks(4);
    ASSERT_TRUE(create("steps", spec).ok());
    ASSERT_TRUE(create("calls", spec).ok());
    set_timeout(context_, std::chrono::minutes(5));
    stream_ = stubs().queries->StreamQueries(&context_);
  }

  StepOutcome unary_step(const v1::UpdateBatch& update, const v1::QueryBatch& queries) {
    v1::StepRequest request;
    request.set_scene("steps");
    *request.mutable_update() = update;
    *request.mutable_queries() = queries;
    v1::StepResponse response;
    const grpc::Status status = call(*stubs().queries, &v1::QueryService::Stub::Step, request, &response);
    StepOutcome outcome;
    if (!status.ok()) outcome.error = debug_text(error_of(status));
    outcome.ack = response.ack();
    outcome.result = response.result();
    if (response.has_error()) outcome.query_error = debug_text(response.error());
    return outcome;
  }

  StepOutcome streamed_step(const v1::UpdateBatch& update, const v1::QueryBatch& queries) {
    v1::StreamQueriesRequest request;
    request.set_scene("steps");
    *request.mutable_update() = update;
    *request.mutable_batch() = queries;
    v1::StreamQueriesResponse response;
    EXPECT_TRUE(stream_->Write(request));
    EXPECT_TRUE(stream_->Read(&response));
    StepOutcome outcome;
    outcome.ack = response.ack();
    outcome.result = response.result();
    if (response.has_error()) (response.has_ack() ? outcome.query_error : outcome.error) = debug_text(response.error());
    return outcome;
  }

  // Makes the step by calls on the scene `scene`. Wrong queries are tried first, because a step that has some changes
  // nothing.
  StepOutcome two_calls(const v1::UpdateBatch& update, const v1::QueryBatch& queries, const std::string& scene) {
    StepOutcome outcome;
    v1::QueryBatch form = queries;
    for (v1::QueryBlock& block : *form.mutable_blocks()) block.clear_as_of_ticks();
    if (const grpc::Status status = query(form, nullptr, scene); !status.ok()) {
      outcome.error = debug_text(error_of(status));
      return outcome;
    }
    if (const grpc::Status status = apply(update, &outcome.ack, scene); !status.ok()) {
      outcome.error = debug_text(error_of(status));
      outcome.ack.Clear();
      return outcome;
    }
    if (const grpc::Status status = query(queries, &outcome.result, scene); !status.ok()) {
      outcome.query_error = debug_text(error_of(status));
      outcome.result.Clear();
    }
    return outcome;
  }

  static v1::UpdateBatch random_update(Random& random, uint64_t tick) {
    v1::UpdateBatch batch;
    batch.set_tick(tick);
    batch.set_all_or_nothing(random.below(4) == 0);
    batch.set_upsert(random.below(2) == 0);
    batch.set_clear(random.below(20) == 0);
    if (random.below(4) == 0) batch.add_remove_ids(1 + random.below(kIds));
    if (random.below(2) == 0) {
      v1::Insert& insert = *batch.add_inserts();
      insert.mutable_ball()->add_radii(1);
      insert.add_ids(1 + random.below(kIds));
      for (int axis = 0; axis < 3; ++axis) insert.add_positions(static_cast<float>(random.whole(-9, 9)));
    }
    for (uint64_t moves = random.below(3); moves > 0; --moves) {
      v1::Move& move = *batch.add_moves();
      move.add_ids(1 + random.below(kIds));
      for (int axis = 0; axis < 3; ++axis) move.add_positions(static_cast<float>(random.whole(-9, 9)));
    }
    if (batch.moves_size() > 0 && random.below(6) == 0) batch.mutable_moves(0)->add_positions(1);  // a wrong length
    return batch;
  }

  static v1::QueryBatch random_queries(Random& random, uint64_t tick) {
    v1::QueryBatch batch;
    v1::Balls& balls = *batch.add_blocks()->mutable_balls();
    for (int axis = 0; axis < 3; ++axis) balls.add_centers(static_cast<float>(random.whole(-9, 9)));
    balls.add_radii(6);
    v1::QueryBlock& past = *batch.add_blocks();
    past.mutable_lookup()->add_ids(1 + random.below(kIds));
    past.add_columns(v1::COLUMN_ID);
    past.add_columns(v1::COLUMN_POSE);
    if (random.below(2) == 0) past.add_as_of_ticks(tick - random.below(8));  // perhaps before the history
    if (random.below(8) == 0) balls.set_radii(0, -1);                        // a wrong value
    return batch;
  }

  // Makes random steps by `step` and by two calls; returns the first difference, or an empty text.
  std::string difference(uint64_t seed, int steps, const Step& step) {
    Random random(seed);
    for (int i = 0; i < steps; ++i) {
      const uint64_t tick = 100 + static_cast<uint64_t>(i);
      const v1::UpdateBatch update = random_update(random, tick);
      const v1::QueryBatch queries = random_queries(random, tick);
      const std::string got = step(update, queries).text();
      const std::string wanted = two_calls(update, queries, "calls").text();
      if (got != wanted)
        return absl::StrCat("step ", i, " of seed ", seed, ": ", got, "\nby two calls: ", wanted, "\nof ",
                            update.DebugString(), queries.DebugString());
    }
    return "";
  }

  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::StreamQueriesRequest, v1::StreamQueriesResponse>> stream_;
};

TEST_F(StepPropertyTest, AStepEqualsAnUpdateAndThenAQuery) {
  constexpr uint64_t kSeed = 701;
  Random form(kSeed);
  EXPECT_EQ(difference(kSeed, 400,
                       [&](const v1::UpdateBatch& update, const v1::QueryBatch& queries) {
                         return form.below(2) == 0 ? unary_step(update, queries) : streamed_step(update, queries);
                       }),
            "");
}

TEST_F(StepPropertyTest, QueriesThatRunBeforeTheUpdateAreNoticed) {
  EXPECT_NE(difference(702, 100,
                       [this](const v1::UpdateBatch& update, const v1::QueryBatch& queries) {
                         StepOutcome outcome = unary_step({}, queries);
                         if (!outcome.error.empty()) return outcome;
                         const StepOutcome applied = unary_step(update, {});
                         outcome.ack = applied.ack;
                         outcome.error = applied.error;
                         return outcome;
                       }),
            "");
}

TEST_F(StepPropertyTest, AnUpdateThatIsAppliedBesideWrongQueriesIsNoticed) {
  EXPECT_NE(difference(703, 100,
                       [this](const v1::UpdateBatch& update, const v1::QueryBatch& queries) {
                         StepOutcome outcome = unary_step(update, queries);
                         if (!outcome.error.empty()) unary_step(update, {});
                         return outcome;
                       }),
            "");
}

TEST_F(StepPropertyTest, AnAckThatFailedQueriesLoseIsNoticed) {
  EXPECT_NE(difference(704, 100,
                       [this](const v1::UpdateBatch& update, const v1::QueryBatch& queries) {
                         StepOutcome outcome = streamed_step(update, queries);
                         if (outcome.query_error.empty()) return outcome;
                         outcome.error.swap(outcome.query_error);
                         outcome.ack.Clear();
                         return outcome;
                       }),
            "");
}

}  // namespace
}  // namespace locus::test
