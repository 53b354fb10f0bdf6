// The metadata every call about a scene carries. Internal to the library.
#ifndef LOCUS_CLIENT_LIB_CALL_METADATA_H_
#define LOCUS_CLIENT_LIB_CALL_METADATA_H_

#include "absl/strings/string_view.h"

namespace grpc {
class ClientContext;
}

namespace locus::client {

// Sets `x-scene`, by which routers go. A name with characters that no scene may have is left out: gRPC aborts on bytes
// that are illegal in metadata, and the server refuses the name itself with a message that helps.
void add_scene(grpc::ClientContext& context, absl::string_view scene);

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_CALL_METADATA_H_
