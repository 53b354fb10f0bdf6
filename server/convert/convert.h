// The only way between the protocol's messages and the core's types. Columns are borrowed: what comes out points into
// the message, which must outlive it. Checks what only the protocol can get wrong (enum numbers, fields that exclude
// each other, kinds that are not served); lengths and values are the core's to check.
//
// Pure functions. Errors name the field as the protocol spells it.
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

template <class Repeated>
auto span_of(const Repeated& column) {
  return absl::MakeConstSpan(column.data(), static_cast<size_t>(column.size()));
}

Vec3d to_vec(const v1::Vec3d& vec);
v1::Vec3d to_proto(const Vec3d& vec);

// Both fields 0 and a revision set to 0 are as the schema says: the latest, unchecked.
View to_view(const v1::View& view);

// Also refuses more lists than a batch may have, before anything is allocated for them.
absl::StatusOr<UpdateBatch> to_updates(const v1::UpdateBatch& batch);
v1::UpdateAck to_proto(const UpdateAck& ack);

absl::StatusOr<QueryBatch> to_queries(const v1::QueryBatch& batch);
v1::Work to_proto(const Work& work, uint64_t nanoseconds);

// Without `static_from`, which the registry looks up.
absl::StatusOr<SceneSpec> to_spec(const v1::SceneSpec& spec);
absl::Status check_labels(const google::protobuf::Map<std::string, std::string>& labels, const std::string& field);
v1::Scene to_proto(const Scene& scene);
v1::Mesh to_proto(const Registry::NamedMesh& mesh);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONVERT_CONVERT_H_
