// The scene that a stream serves: named by its first message, and by every later one that names any.
#ifndef LOCUS_SERVER_RPC_SCENE_BINDING_H_
#define LOCUS_SERVER_RPC_SCENE_BINDING_H_

#include <string>

#include "core/base/refusal.h"
#include "core/base/status_macros.h"
#include "core/scene/registry.h"
#include "server/rpc/call.h"

namespace locus::server {

class SceneBinding {
 public:
  // For every message. What this refuses, of the first one only, ends the stream.
  absl::Status bind(const Caller& caller, const std::string& scene) {
    if (!scene_.empty()) return absl::OkStatus();
    RETURN_IF_ERROR(check_scene_name(scene, "scene"));
    RETURN_IF_ERROR(caller.check_scene(scene));
    scene_ = scene;
    return absl::OkStatus();
  }
  // For every message, after that. What it refuses is an answer.
  absl::Status check(const std::string& scene) const {
    if (scene.empty() || scene == scene_) return absl::OkStatus();
    return refuse_argument(Reason::kMalformed, "scene", {},
                           "this stream serves the scene its first message named; open another one");
  }
  const std::string& scene() const { return scene_; }

 private:
  std::string scene_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_SCENE_BINDING_H_
