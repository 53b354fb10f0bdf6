// Fake UpdateService with configurable failures, a part of FakeServer. For tests of update streams and steps. Handlers
// run on gRPC's threads, so tests configure failures before the first call, or by members that lock a mutex.
#ifndef LOCUS_TESTS_CLIENT_LIB_FAKE_UPDATES_H_
#define LOCUS_TESTS_CLIENT_LIB_FAKE_UPDATES_H_

#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "locus/v1/errors.pb.h"
#include "locus/v1/update_service.grpc.pb.h"

namespace locus::client::testing {

// Returns a refusal as the server sends it, including its details.
inline grpc::Status refusal(grpc::StatusCode code, const std::string& message, const v1::Error& fields) {
  v1::Error error = fields;
  error.set_code(code);
  error.set_message(message);
  v1::Status status;
  status.set_code(code);
  status.set_message(message);
  status.add_details()->PackFrom(error);
  return grpc::Status(code, message, status.SerializeAsString());
}

inline std::string metadata_of(const grpc::ServerContext& context, const std::string& key) {
  const auto found = context.client_metadata().find(key);
  return found == context.client_metadata().end() ? "" : std::string(found->second.data(), found->second.size());
}

// Fake UpdateService: acknowledges batches by the protocol's rules for writer ids and batch numbers, and breaks streams
// as configured in `breaks`.
class FakeUpdates final : public v1::UpdateService::Service {
 public:
  // Plan for breaking streams. If `apply_last` is set, the last message before a break is applied, but its ack is not
  // sent.
  struct Breaks {
    int after_messages = 0;  // number of messages after which a stream breaks
    int times = 0;           // total number of streams that break; 0 = none
    bool apply_last = false;
    grpc::Status status{grpc::StatusCode::UNAVAILABLE, "planned"};
  };

  grpc::Status ApplyUpdates(grpc::ServerContext* context, const v1::ApplyUpdatesRequest* request,
                            v1::ApplyUpdatesResponse* response) override {
    std::lock_guard lock(mutex_);
    ++calls;
    scenes.push_back(metadata_of(*context, "x-scene"));
    if (failing_calls > 0) {
      --failing_calls;
      break_at(request->batch());
      return {grpc::StatusCode::UNAVAILABLE, "planned"};
    }
    v1::StreamUpdatesResponse answer = apply(request->batch());
    if (answer.has_error()) {
      return refusal(static_cast<grpc::StatusCode>(answer.error().code()), answer.error().message(), answer.error());
    }
    *response->mutable_ack() = answer.ack();
    return grpc::Status::OK;
  }

  grpc::Status StreamUpdates(
      grpc::ServerContext* context,
      grpc::ServerReaderWriter<v1::StreamUpdatesResponse, v1::StreamUpdatesRequest>* stream) override {
    v1::StreamUpdatesRequest request;
    std::vector<v1::UpdateBatch> held;  // messages with `continues`
    bool refused = false;               // one of the held messages was refused
    int messages = 0;
    {
      std::lock_guard lock(mutex_);
      ++streams;
      scenes.push_back(metadata_of(*context, "x-scene"));
    }
    while (stream->Read(&request)) {
      std::unique_lock lock(mutex_);
      if (breaks.times > 0 && ++messages >= breaks.after_messages) {
        --breaks.times;
        break_at(request.batch(), held);
        return breaks.status;
      }
      v1::StreamUpdatesResponse answer;
      if (request.batch().continues() && !forgets_continues) {
        answer = hold(request.batch(), held, refused);
      } else {
        if (refused) {
          set_error(answer, grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED);
        } else {
          answer = apply(request.batch(), held);
        }
        held.clear();
        refused = false;
      }
      answer.set_sequence(request.sequence());
      lock.unlock();
      if (!stream->Write(answer)) break;
    }
    return grpc::Status::OK;
  }

  // Applies the update of a step. Returns nothing if the stream must break instead, with the status breaks.status;
  // `messages` is the number of messages of the stream so far.
  std::optional<v1::StreamUpdatesResponse> apply_step(const v1::UpdateBatch& batch, int messages) {
    std::lock_guard lock(mutex_);
    if (breaks.times > 0 && messages == breaks.after_messages) {
      --breaks.times;
      break_at(batch);
      return std::nullopt;
    }
    return apply(batch);
  }

  // Returns the ticks of the applied batches, in order; tests give each batch its own tick.
  std::vector<uint64_t> applied() const {
    std::lock_guard lock(mutex_);
    return applied_;
  }

  // Returns the numbers of messages of the applied batches, in order.
  std::vector<size_t> applied_messages() const {
    std::lock_guard lock(mutex_);
    return applied_messages_;
  }

  // Returns the values of `lease_ms` of the applied batches, in order.
  std::vector<uint32_t> leases() const {
    std::lock_guard lock(mutex_);
    return leases_;
  }

  // Breaks the stream of the next message, which is lost.
  void break_next_message() {
    std::lock_guard lock(mutex_);
    breaks.times = 1;
    breaks.after_messages = 0;
  }

  // Forgets the batch numbers of every writer, like a server that lost its state.
  void forget_writers() {
    std::lock_guard lock(mutex_);
    next_.clear();
  }

  Breaks breaks;
  std::set<uint64_t> refused_ticks;  // ticks whose batches are refused
  std::set<uint64_t> denied_ticks;   // ticks whose batches the caller has no right to send
  // Ticks whose batches are refused, before their number is checked, once they were applied or their message was lost.
  std::set<uint64_t> refused_repeats;
  bool forgets_continues = false;  // applies each message with `continues`, like a server that does not know the field
  int failing_calls = 0;
  int calls = 0;
  int streams = 0;
  int duplicates = 0;
  int gaps = 0;
  std::vector<std::string> scenes;  // value of the metadata key x-scene in each call
  // Errors of refused items that every ack returns.
  std::vector<v1::ItemError> item_errors;
  v1::UpdateBatch last_batch;

 private:
  // Handles the last message before a break.
  void break_at(const v1::UpdateBatch& batch, const std::vector<v1::UpdateBatch>& held = {}) {
    if (breaks.apply_last && !batch.continues()) apply(batch, held);
    seen_.insert(batch.tick());
  }

  // Holds a message with `continues`. Refuses it, as the server does, if it has a setting that only the last message
  // may have, or if an earlier message was refused.
  static v1::StreamUpdatesResponse hold(const v1::UpdateBatch& batch, std::vector<v1::UpdateBatch>& held,
                                        bool& refused) {
    v1::StreamUpdatesResponse answer;
    if (refused) {
      set_error(answer, grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_MALFORMED);
    } else if (batch.has_tick() || batch.writer() != 0 || batch.all_or_nothing() || batch.lease_ms() != 0) {
      set_error(answer, grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_OUT_OF_RANGE);
      refused = true;
    } else {
      held.push_back(batch);
      answer.mutable_ack()->set_pending(true);
    }
    return answer;
  }

  v1::StreamUpdatesResponse apply(const v1::UpdateBatch& batch, const std::vector<v1::UpdateBatch>& held = {}) {
    v1::StreamUpdatesResponse response;
    if (denied_ticks.count(batch.tick()) > 0) {
      set_error(response, grpc::StatusCode::PERMISSION_DENIED, v1::REASON_UNSPECIFIED);
      return response;
    }
    if (seen_.count(batch.tick()) > 0 && refused_repeats.count(batch.tick()) > 0) {
      set_error(response, grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_SCENE_RESTARTED);
      return response;
    }
    uint64_t& next = next_.try_emplace(batch.writer(), 1).first->second;
    if (batch.writer() != 0 && batch.batch() > next) {
      ++gaps;
      set_error(response, grpc::StatusCode::FAILED_PRECONDITION, v1::REASON_BATCH_GAP);
      response.mutable_error()->set_limit_value(static_cast<double>(next));
      return response;
    }
    if (refused_ticks.count(batch.tick()) > 0) {
      set_error(response, grpc::StatusCode::INVALID_ARGUMENT, v1::REASON_COLUMN_LENGTH);
      return response;
    }
    v1::UpdateAck& ack = *response.mutable_ack();
    ack.set_epoch(9);
    if (batch.writer() != 0 && batch.batch() < next) {
      ++duplicates;
      ack.set_duplicate(true);
    } else {
      ++next;
      applied_.push_back(batch.tick());
      applied_messages_.push_back(held.size() + 1);
      leases_.push_back(batch.lease_ms());
      last_batch = batch;
    }
    ack.set_revision(applied_.size());
    ack.set_applied(1);
    ack.set_refused(static_cast<uint32_t>(item_errors.size()));
    ack.mutable_errors()->Add(item_errors.begin(), item_errors.end());
    return response;
  }

  static void set_error(v1::StreamUpdatesResponse& response, grpc::StatusCode code, v1::Reason reason) {
    response.mutable_error()->set_code(code);
    response.mutable_error()->set_message("planned refusal");
    response.mutable_error()->set_reason(reason);
  }

  mutable std::mutex mutex_;
  std::map<uint64_t, uint64_t> next_;
  std::set<uint64_t> seen_;  // ticks of the last messages before breaks
  std::vector<uint64_t> applied_;
  std::vector<size_t> applied_messages_;
  std::vector<uint32_t> leases_;
};

}  // namespace locus::client::testing

#endif  // LOCUS_TESTS_CLIENT_LIB_FAKE_UPDATES_H_
