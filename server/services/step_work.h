// Work on one message of QueryService: a query batch, or a step, which is an update batch and a query batch that sees
// the update. A message without an update goes straight to QueryWork. A step is checked as a whole first; then its
// update is applied, and the handler that receives the ack begins the queries at the ack's revision. So a step takes
// no more thread changes than its two parts need alone, and none if both parts are small.
//
//   begin() --no update--> QueryWork::begin() ----------------------------------------> QueryWork answers
//      |                                                                                    ^
//      | QueryWork::prepare(), then UpdateWork::begin()                                     |
//      v                                                                                    |
//   UPDATING --applied: ack--> QueryWork::start(), at the revision of the ack or later -----+
//      |
//      +--refused: the queries never run --> answered with the error, without an ack
//
// Threads: all members run on the call's IO loop.
#ifndef LOCUS_SERVER_SERVICES_STEP_WORK_H_
#define LOCUS_SERVER_SERVICES_STEP_WORK_H_

#include <cstdint>
#include <string>
#include <utility>

#include "absl/status/status.h"
#include "locus/v1/query_service.pb.h"
#include "server/host/host.h"
#include "server/rpc/call_slot.h"
#include "server/services/query_work.h"
#include "server/services/update_work.h"

namespace locus::server {

// `Response` is the response message, with the fields `ack` and `result`. It sets `ack` only if an update was applied,
// and `result` unless the slot is answered with an error.
template <class Response>
class StepWork final {
 public:
  StepWork(Host& host, CallSlot& slot, Rpc rpc)
      : slot_(slot), update_slot_(*this), query_(host, slot, rpc), update_(host, update_slot_) {}

  // Begins the work on a message without an update. `queries` and `response` are borrowed until the slot is answered.
  void begin(const std::string& scene, const v1::QueryBatch& queries, Response& response) {
    response.clear_ack();
    query_.begin(scene, queries, *response.mutable_result());
  }
  // Begins the work on a step. The arguments are borrowed until the slot is answered.
  void begin(const std::string& scene, const v1::UpdateBatch& update, const v1::QueryBatch& queries,
             Response& response) {
    response.clear_ack();
    response_ = &response;
    absl::Status status = check_right(scene);
    if (status.ok()) status = query_.prepare(scene, queries, *response.mutable_result());
    if (!status.ok()) return slot_.answered(std::move(status));
    update_.begin(scene, update, *response.mutable_ack());
  }
  // Makes the work answer soon. An update is never given up, because it does not wait for the caller.
  void give_up() { query_.give_up(); }

 private:
  // Slot of the step's update: its answer does not answer the message, but begins the queries.
  class UpdateSlot final : public CallSlot {
   public:
    explicit UpdateSlot(StepWork& step) : step_(step) {}
    const Caller& caller() const override { return step_.slot_.caller(); }
    IoLoop& io() const override { return step_.slot_.io(); }
    uint64_t client() const override { return step_.slot_.client(); }
    bool stream() const override { return step_.slot_.stream(); }
    absl::Status claim_answer(uint64_t bytes) override {
      step_.ack_bytes_ = bytes;
      return step_.slot_.claim_answer(bytes);
    }
    CallMemory take_request_claim() override { return step_.slot_.take_request_claim(); }
    void hold() override { step_.slot_.hold(); }
    void answered(absl::Status status) override { step_.updated(std::move(status)); }

   private:
    StepWork& step_;
  };

  // Returns PERMISSION_DENIED if the caller may read the scene but not update it. StreamQueries itself needs the right
  // to read only. Returns OK if the caller may not read the scene either, because prepare() then finds no scene.
  absl::Status check_right(const std::string& scene) const {
    const Caller& caller = slot_.caller();
    if (caller.may(Right::kUpdate, scene) || !caller.may(Right::kRead, scene)) return absl::OkStatus();
    return caller.lacks_right(Right::kUpdate, scene);
  }

  // Begins the queries after the update was applied, or answers with the error of the refused update.
  void updated(absl::Status status) {
    if (status.ok()) return query_.start(response_->ack().revision(), ack_bytes_);
    response_->clear_ack();
    query_.cancel();
    slot_.answered(std::move(status));
  }

  CallSlot& slot_;
  UpdateSlot update_slot_;
  QueryWork query_;
  UpdateWork update_;
  Response* response_ = nullptr;
  uint64_t ack_bytes_ = 0;  // bytes claimed for the ack
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_STEP_WORK_H_
