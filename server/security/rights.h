// Rights, and the one table that says which right each rpc and each HTTP page needs. Constants and pure functions; any
// thread.
#ifndef LOCUS_SERVER_SECURITY_RIGHTS_H_
#define LOCUS_SERVER_SECURITY_RIGHTS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "absl/strings/string_view.h"

namespace locus::server {

// Right that a grant gives. The first three are rights to scenes, and each of them includes the rights before it. The
// others are rights to the server as a whole.
enum class Right : uint8_t { kRead, kUpdate, kAdmin, kMeshes, kBackup, kMetrics, kReflection };
inline constexpr size_t kRights = 7;
inline constexpr std::array<absl::string_view, kRights> kRightNames = {"read",   "update",  "admin",     "meshes",
                                                                       "backup", "metrics", "reflection"};

constexpr absl::string_view right_name(Right right) { return kRightNames[static_cast<size_t>(right)]; }
// Returns whether this is a right to scenes. A grant of such a right names the scenes to which it applies.
constexpr bool is_scene_right(Right right) { return right <= Right::kAdmin; }

// Condition under which an rpc is allowed.
enum class Need : uint8_t {
  kNothing,      // everybody
  kAnyGrant,     // everybody who has at least one right (AccessRules::knows)
  kSceneRight,   // `right` to the scene that the request names
  kServerRight,  // `right`, a right to the server as a whole
  kListed,       // like kAnyGrant, but the answer contains only scenes to which the caller has `right`
};

// Place of the scene's name in the request.
enum class SceneField : uint8_t {
  kNone,          // the request names no scene
  kScene,         // field `scene`
  kName,          // field `name`
  kFirstMessage,  // field `scene` of the first message of the stream
};

struct RpcRight {
  absl::string_view path;  // full method path
  Need need;
  Right right;  // meaningless for kNothing; for kAnyGrant used only in the texts of refusals
  SceneField scene = SceneField::kNone;
  // True if the request can name a second scene, in `spec.static_from`. The caller then needs the right kRead to that
  // scene, too.
  bool reads_static_from = false;
};

inline constexpr std::array kRpcRights = std::to_array<RpcRight>({
    {"/locus.v1.QueryService/Query", Need::kSceneRight, Right::kRead, SceneField::kScene},
    {"/locus.v1.QueryService/StreamQueries", Need::kSceneRight, Right::kRead, SceneField::kFirstMessage},
    {"/locus.v1.QueryService/Step", Need::kSceneRight, Right::kUpdate, SceneField::kScene},
    {"/locus.v1.UpdateService/ApplyUpdates", Need::kSceneRight, Right::kUpdate, SceneField::kScene},
    {"/locus.v1.UpdateService/StreamUpdates", Need::kSceneRight, Right::kUpdate, SceneField::kFirstMessage},
    {"/locus.v1.SceneService/CreateScene", Need::kSceneRight, Right::kAdmin, SceneField::kName, true},
    {"/locus.v1.SceneService/GetScene", Need::kSceneRight, Right::kRead, SceneField::kName},
    {"/locus.v1.SceneService/ListScenes", Need::kListed, Right::kRead},
    {"/locus.v1.SceneService/DeleteScene", Need::kSceneRight, Right::kAdmin, SceneField::kName},
    {"/locus.v1.SceneService/UpdateScene", Need::kSceneRight, Right::kAdmin, SceneField::kName},
    {"/locus.v1.SceneService/UploadMesh", Need::kServerRight, Right::kMeshes},
    {"/locus.v1.SceneService/ListMeshes", Need::kServerRight, Right::kMeshes},
    {"/locus.v1.SceneService/DeleteMesh", Need::kServerRight, Right::kMeshes},
    {"/locus.v1.SceneService/DownloadMesh", Need::kServerRight, Right::kMeshes},
    {"/locus.v1.SceneService/ChangeInstances", Need::kSceneRight, Right::kUpdate, SceneField::kScene},
    {"/locus.v1.SceneService/DumpScene", Need::kSceneRight, Right::kRead, SceneField::kScene},
    {"/locus.v1.ServerService/GetServer", Need::kAnyGrant, Right::kRead},
    {"/locus.v1.ServerService/GetQuotas", Need::kAnyGrant, Right::kRead},
    {"/locus.v1.ServerService/Backup", Need::kServerRight, Right::kBackup},
    {"/locus.v1.ServerService/MoveScene", Need::kSceneRight, Right::kAdmin, SceneField::kScene},
    {"/grpc.health.v1.Health/Check", Need::kNothing, Right::kRead},
    {"/grpc.health.v1.Health/Watch", Need::kNothing, Right::kRead},
    {"/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", Need::kServerRight, Right::kReflection},
    // This server implements v1alpha only. Clients call v1 first and fall back to v1alpha if the answer is
    // UNIMPLEMENTED, so a caller with the right must get that answer instead of PERMISSION_DENIED.
    {"/grpc.reflection.v1.ServerReflection/ServerReflectionInfo", Need::kServerRight, Right::kReflection},
});

// Right that the HTTP page /metrics needs; /healthz and /readyz are for everybody.
inline constexpr Right kMetricsPageRight = Right::kMetrics;

// Returns the row of an rpc by its full method path; nullptr for an unknown path, which nobody may call.
const RpcRight* right_of(absl::string_view path);

// Returns the right of a name such as "read"; nullopt if no right has this name.
std::optional<Right> right_named(absl::string_view name);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_RIGHTS_H_
