// Inflates messages that callers compressed with gzip, for servers with --accept-compression. gRPC 1.51 limits only the
// compressed size of a message and would inflate the message to any size, so gRPC is configured to pass compressed
// messages on unchanged. Functions without state; any thread.
#ifndef LOCUS_SERVER_RPC_INFLATE_H_
#define LOCUS_SERVER_RPC_INFLATE_H_

#include <grpcpp/support/byte_buffer.h>

#include <cstdint>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "server/rpc/call_memory.h"

namespace locus::server {

// Returns whether the bytes begin with the first byte of gzip. No Protobuf message begins with this byte, because it
// would be a tag with the wire type 7, which does not exist.
bool is_gzip(const grpc::ByteBuffer& bytes);

// Function that claims an amount of memory in bytes for the caller, such as Caller::claim().
using ClaimBytes = absl::FunctionRef<absl::StatusOr<CallMemory>(uint64_t bytes)>;

// Replaces `bytes` by their inflated content. Returns the claims of the content's memory. Each claim is made by `claim`
// before the claimed memory is allocated. Returns RESOURCE_EXHAUSTED naming the limit receive_bytes if the content has
// more than `max_bytes` bytes, INVALID_ARGUMENT (MALFORMED) for bytes that are not exactly one gzip stream, and errors
// of `claim`. After an error, `bytes` are unchanged. Cost: 3 ms for each MiB of the result.
absl::StatusOr<std::vector<CallMemory>> inflate_gzip(ClaimBytes claim, uint64_t max_bytes, grpc::ByteBuffer& bytes);

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_INFLATE_H_
