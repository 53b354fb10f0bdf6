// Rules for the names of scenes and meshes. `field` is the path of the name in the request. Functions without state;
// any thread.
#ifndef LOCUS_CORE_BASE_NAMES_H_
#define LOCUS_CORE_BASE_NAMES_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus {

// Returns OK if `name` matches ^[a-z]([a-z0-9._-]{0,61}[a-z0-9])?$, otherwise INVALID_ARGUMENT naming `field`.
absl::Status check_scene_name(absl::string_view name, absl::string_view field);
// Returns OK if `name` has 1 to 63 printable ASCII characters and no space, otherwise INVALID_ARGUMENT naming `field`.
absl::Status check_mesh_name(absl::string_view name, absl::string_view field);

}  // namespace locus

#endif  // LOCUS_CORE_BASE_NAMES_H_
