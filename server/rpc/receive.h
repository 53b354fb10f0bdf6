// Conversion of a call's messages from bytes and to bytes. A received message is scanned and its memory is claimed
// before it is parsed. Functions without state; any thread.
#ifndef LOCUS_SERVER_RPC_RECEIVE_H_
#define LOCUS_SERVER_RPC_RECEIVE_H_

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

#include "absl/status/statusor.h"
#include "server/rpc/call.h"
#include "server/rpc/wire_plan.h"

namespace locus::server {

// Parses `bytes`, which it empties, into `request`. Returns a claim of the memory that the parsed message takes. Errors
// of WirePlan::scan(), Caller::claim() and, if the server accepts compressed messages, inflate_gzip(). After an
// error other than those of inflate_gzip(), `bytes` have the content that they had.
absl::StatusOr<CallMemory> parse_request(const Caller& caller, const WirePlan& plan, grpc::ByteBuffer& bytes,
                                         google::protobuf::Message& request);

// Parses of `bytes` only the numbers and the short texts of the message itself, such as the sequence number of a
// message of a stream, so that a message can be refused by name although it was not parsed. Claims no memory, because
// these fields take at most a few kilobytes. Returns false if the bytes are no message of this type, or if they have
// more such fields. Does not change `bytes`.
bool parse_envelope(const grpc::ByteBuffer& bytes, google::protobuf::Message& request);

// Returns the bytes of a response.
grpc::ByteBuffer to_bytes(const google::protobuf::Message& response);

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_RECEIVE_H_
