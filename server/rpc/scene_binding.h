// The scene that a stream serves. The first message of the stream must name the scene; later messages may leave the
// name out. While the stream is open, the scene is in use, so that it is not deleted as idle, if the caller has the
// right to it. Threads: the stream's IO loop only.
#ifndef LOCUS_SERVER_RPC_SCENE_BINDING_H_
#define LOCUS_SERVER_RPC_SCENE_BINDING_H_

#include <string>

#include "core/base/names.h"
#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "server/rpc/call.h"

namespace locus::server {

// Invariant: the scene never changes once it is set.
class SceneBinding {
 public:
  SceneBinding() = default;
  ~SceneBinding() {
    if (uses_ != nullptr) uses_->stream_closed(scene_);
  }
  SceneBinding(const SceneBinding&) = delete;
  SceneBinding& operator=(const SceneBinding&) = delete;

  // Sets the scene to `scene`, the name in the first message. Call bind() for every message; for later messages it does
  // nothing. After an error the stream must end.
  absl::Status bind(const Caller& caller, const std::string& scene) {
    if (!scene_.empty()) return absl::OkStatus();
    RETURN_IF_ERROR(check_scene_name(scene, "scene"));
    RETURN_IF_ERROR(caller.check_scene(scene));
    scene_ = scene;
    if (caller.state().idle_scenes == nullptr || !caller.check_right(scene).ok()) return absl::OkStatus();
    uses_ = caller.state().idle_scenes;
    uses_->stream_opened(scene);
    return absl::OkStatus();
  }
  // Refuses a message that names another scene. Call it for every message, after bind(). An error is the answer to that
  // message; the stream continues.
  absl::Status check(const std::string& scene) const {
    if (scene.empty() || scene == scene_) return absl::OkStatus();
    return refuse_argument(Reason::kMalformed, "scene", {},
                           "this stream serves the scene that its first message named; open another stream");
  }
  const std::string& scene() const { return scene_; }

 private:
  std::string scene_;
  IdleScenes* uses_ = nullptr;  // counts this stream; null if it does not
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_SCENE_BINDING_H_
