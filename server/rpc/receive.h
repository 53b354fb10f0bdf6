// Conversion of a call's messages from bytes and to bytes. A received message is scanned and its memory is claimed
// before it is parsed. Functions without state; any thread.
#ifndef LOCUS_SERVER_RPC_RECEIVE_H_
#define LOCUS_SERVER_RPC_RECEIVE_H_

#include <google/protobuf/message.h>
#include <grpcpp/support/byte_buffer.h>

#include <optional>

#include "absl/status/statusor.h"
#include "server/rpc/call.h"
#include "server/rpc/wire_plan.h"

namespace locus::server {

// Parses `bytes` into `request`, and empties `bytes`. Returns a claim of the memory of the parsed message. Errors are
// those of inflate_gzip() if the server accepts compressed messages, those of WirePlan::scan() and Caller::claim(), and
// INVALID_ARGUMENT (MALFORMED) if Protobuf cannot parse the bytes. After an error of scan() or claim(), `bytes` still
// contain the message, inflated if it was compressed.
absl::StatusOr<CallMemory> parse_request(const Caller& caller, const WirePlan& plan, grpc::ByteBuffer& bytes,
                                         google::protobuf::Message& request);

// Parses only the envelope of a message: its numbers and short texts, without its sub-messages. The envelope of a
// stream's message has the sequence number, which is needed to refuse a message that was not parsed. Claims no memory,
// because an envelope has at most 2048 bytes. Returns false if the bytes are not a message of this type, or if the
// envelope is too large. Does not change `bytes`.
bool parse_envelope(const grpc::ByteBuffer& bytes, google::protobuf::Message& request);

// Reads the field `number`, a bool, of the sub-message in the field `parent` of a message that was not parsed. Returns
// nullopt if the bytes are not a message, for example because they are compressed. Claims no memory.
std::optional<bool> read_flag(const grpc::ByteBuffer& bytes, int parent, int number);

// Returns the bytes of a response.
grpc::ByteBuffer to_bytes(const google::protobuf::Message& response);

}  // namespace locus::server

#endif  // LOCUS_SERVER_RPC_RECEIVE_H_
