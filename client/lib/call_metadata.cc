#include "client/lib/call_metadata.h"

#include <algorithm>
#include <string>

#include "absl/strings/ascii.h"
#include "grpcpp/client_context.h"

namespace locus::client {

void add_scene(grpc::ClientContext& context, absl::string_view scene) {
  constexpr size_t kMaxSceneName = 63;
  const bool legal =
      !scene.empty() && scene.size() <= kMaxSceneName && std::all_of(scene.begin(), scene.end(), [](unsigned char c) {
        return absl::ascii_islower(c) || absl::ascii_isdigit(c) || c == '-';
      });
  if (legal) context.AddMetadata("x-scene", std::string(scene));
}

}  // namespace locus::client
