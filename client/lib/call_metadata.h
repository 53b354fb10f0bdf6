// Metadata that each call about a scene sends. Internal to the library.
#ifndef LOCUS_CLIENT_LIB_CALL_METADATA_H_
#define LOCUS_CLIENT_LIB_CALL_METADATA_H_

#include "absl/strings/string_view.h"

namespace grpc {
class ClientContext;
}

namespace locus::client {

// Adds the metadata entry `x-scene`, which routers use to find the server of a scene. Adds nothing if `scene` is not a
// valid scene name: gRPC would abort the process for bytes that are illegal in metadata, whereas the server refuses the
// invalid name in the request with a helpful message.
void add_scene(grpc::ClientContext& context, absl::string_view scene);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_CALL_METADATA_H_
