// What update and query streams have in common: one scene a stream, an answer a message, and which errors end what.
#ifndef LOCUS_SERVER_SERVICE_STREAM_LOOP_H_
#define LOCUS_SERVER_SERVICE_STREAM_LOOP_H_

#include <string>

#include "server/service/blocking_stream.h"
#include "server/service/call.h"
#include "server/service/status.h"

namespace locus::server {

// The scene that a stream serves: named by its first message, and by every later one that names any.
class SceneBinding {
 public:
  // For the first message. What it refuses ends the stream.
  absl::Status bind(const Caller& caller, const std::string& scene) {
    if (absl::Status status = check_scene_name(scene, "scene"); !status.ok()) return status;
    scene_ = scene;
    return caller.check_scene(scene);
  }
  // For every message. What it refuses is an answer.
  absl::Status check(const std::string& scene) const {
    if (scene.empty() || scene == scene_) return absl::OkStatus();
    return refuse_argument(Reason::kMalformed, "scene", {},
                           "this stream serves the scene its first message named; open another one");
  }
  const std::string& scene() const { return scene_; }

 private:
  std::string scene_;
};

// Which refusals of a message are the stream's own end: the caller's end of the call, and the server's.
inline bool ends_stream(const Caller& caller, const absl::Status& status) {
  if (status.code() == absl::StatusCode::kCancelled || status.code() == absl::StatusCode::kUnavailable) return true;
  return status.code() == absl::StatusCode::kDeadlineExceeded && !caller.stop().ok();
}

// The status of a stream that has no next message.
inline absl::Status end_of_stream(ReadOutcome outcome) {
  if (outcome == ReadOutcome::kEnd) return absl::OkStatus();
  if (outcome == ReadOutcome::kDraining) return draining();
  return refuse_argument(Reason::kMalformed, "", {}, "the bytes are no message of this stream's type");
}

// Answers message after message with answer(scene name, batch, response), which fills the response's outcome or
// refuses.
template <class Request, class Response, class Answer>
absl::Status answer_all(BlockingStream<Request, Response>& stream, const Caller& caller, absl::string_view rpc,
                        const Answer& answer) {
  SceneBinding binding;
  Request request;
  Response response;
  bool first = true;
  ReadOutcome outcome = stream.read(&request);
  for (; outcome == ReadOutcome::kMessage; outcome = stream.read(&request)) {
    if (first) {
      if (absl::Status status = binding.bind(caller, request.scene()); !status.ok()) {
        log_refusal(rpc, status);
        return status;
      }
      first = false;
    }
    response.Clear();
    response.set_sequence(request.sequence());
    absl::Status status = binding.check(request.scene());
    if (status.ok()) status = answer(binding.scene(), request.batch(), &response);
    if (!status.ok()) {
      log_refusal(rpc, status);
      if (ends_stream(caller, status)) return status;
      *response.mutable_error() = to_error(status);
    }
    if (!stream.write(response)) return absl::CancelledError("the caller is gone");
  }
  return end_of_stream(outcome);
}

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICE_STREAM_LOOP_H_
