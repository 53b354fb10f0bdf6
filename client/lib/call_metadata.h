// Metadata of every call about a scene. Internal to the library.
#ifndef LOCUS_CLIENT_LIB_CALL_METADATA_H_
#define LOCUS_CLIENT_LIB_CALL_METADATA_H_

#include "absl/strings/string_view.h"

namespace grpc {
class ClientContext;
}

namespace locus::client {

// Sets `x-scene`, which routers use to find the server of a scene. Omits names with characters that no scene name may
// have: gRPC aborts on bytes that are illegal in metadata, and the server refuses the name in the request anyway, with
// a helpful message.
void add_scene(grpc::ClientContext& context, absl::string_view scene);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_CALL_METADATA_H_
