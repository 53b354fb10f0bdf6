// The only conversions between the protocol's messages and the core's types. Columns are borrowed: the results point
// into the message, which must outlive them. The functions refuse messages that the core's types cannot represent
// (unknown enum numbers, fields that exclude each other, kinds that are not served); the core checks lengths and
// values.
//
// Pure functions, except that to_change() reads the registry. Errors name the field as the protocol spells it.
#ifndef LOCUS_SERVER_CONVERT_CONVERT_H_
#define LOCUS_SERVER_CONVERT_CONVERT_H_

#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "core/index/work.h"
#include "core/query/query_batch.h"
#include "core/scene/registry.h"
#include "core/scene/scene.h"
#include "core/scene/updates/update_batch.h"
#include "locus/v1/query_service.pb.h"
#include "locus/v1/scene_service.pb.h"
#include "locus/v1/update_service.pb.h"

namespace locus::server {

// Returns a span over a repeated field, without a copy.
template <class Repeated>
auto span_of(const Repeated& column) {
  return absl::MakeConstSpan(column.data(), static_cast<size_t>(column.size()));
}

Vec3d to_vec(const v1::Vec3d& vec);
v1::Vec3d to_proto(const Vec3d& vec);

// Converts a view. A view without a revision requests the latest revision; epoch 0 matches every epoch.
View to_view(const v1::View& view);

// Converts a batch of updates. Refuses more lists than limits::kMaxUpdateLists before anything is allocated for them.
absl::StatusOr<UpdateBatch> to_updates(const v1::UpdateBatch& batch);
v1::UpdateAck to_proto(const UpdateAck& ack);

// Converts a batch of queries. Refuses more blocks than limits::kMaxBlocks before anything is allocated for them.
absl::StatusOr<QueryBatch> to_queries(const v1::QueryBatch& batch);
v1::Work to_proto(const Work& work, uint64_t nanoseconds);

// Converts the specification of a scene, except `static_from`, which the registry resolves.
absl::StatusOr<SceneSpec> to_spec(const v1::SceneSpec& spec);
// Converts a change of instances. Looks the meshes up in `registry`, and shares their ownership. Returns the error of
// check_mesh_name() or Registry::find_mesh(), with the field of the mesh's name.
absl::StatusOr<StaticChange> to_change(const v1::ChangeInstancesRequest& request, const Registry& registry);
// Converts the cell size in the field `field`: 0, or a size that is rounded up to a power of two. Returns
// INVALID_ARGUMENT, NOT_FINITE or OUT_OF_RANGE, for any other number.
absl::StatusOr<double> to_cell_size(double size, absl::string_view field);
// Converts the settings that a request changes. Returns INVALID_ARGUMENT, which names the field, for a setting that
// cannot be changed, for a value that `fields` does not name, and for a field that this server does not know.
absl::StatusOr<SettingsChange> to_settings(const v1::UpdateSceneRequest& request);
absl::Status check_labels(const google::protobuf::Map<std::string, std::string>& labels, const std::string& field);
// Returns the settings of a scene; `settings` has those that can be changed.
v1::SceneSpec spec_to_proto(const SceneSpec& spec, const SceneSettings& settings);
// Returns the description of a scene. `summary` is the summary of this scene.
v1::Scene to_proto(const Scene& scene, const SceneSummary& summary);
v1::Source to_proto(Source source);
// Maximum size in bytes of the parts in the description of a mesh, so that every client accepts a reply that contains
// one description.
inline constexpr size_t kMaxDescribedPartBytes = 3'800'000;
// Returns the description of a mesh with its parts from `first_part` on, as many as fit into `max_part_bytes` bytes.
v1::Mesh to_proto(const Registry::NamedMesh& mesh, size_t first_part = 0,
                  size_t max_part_bytes = kMaxDescribedPartBytes);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONVERT_CONVERT_H_
