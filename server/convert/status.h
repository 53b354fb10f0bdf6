// The only conversion from the server's errors (absl::Status with a Refusal) to the protocol's errors (grpc::Status
// with a locus.v1.Error in its details), and the errors that the server itself returns. Pure functions.
#ifndef LOCUS_SERVER_CONVERT_STATUS_H_
#define LOCUS_SERVER_CONVERT_STATUS_H_

#include <grpcpp/support/status.h>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/base/refusal.h"
#include "locus/v1/errors.pb.h"

namespace locus::server {

// Returns the error that answers a refused message of a stream. `status` must not be OK. Texts, which can contain text
// of the caller, are cut to 1,024 bytes, so that they fit into metadata.
v1::Error to_error(const absl::Status& status);

// Returns the status of a refused call. Its details contain a locus.v1.Status with one Error. If `status` is OK,
// returns OK.
grpc::Status to_grpc(const absl::Status& status);

// Returns UNIMPLEMENTED, REASON_NOT_SERVED: `field` is in the schema, but this build does not serve it.
absl::Status not_served(absl::string_view field);

// Returns INVALID_ARGUMENT, REASON_MALFORMED for a number that is not a value of the schema's enum.
absl::Status unknown_enum(absl::string_view field, int number);

// Returns UNAVAILABLE, REASON_DRAINING, with the delay after which the caller may retry.
absl::Status draining();

// Returns UNAVAILABLE, REASON_RECOVERING, with the delay after which the caller may retry.
absl::Status recovering();

// Returns the error for calls that use a damaged scene or mesh, until it is repaired or deleted. `field` names the
// kind.
absl::Status damaged_data(const char* field, const absl::Status& damage);

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONVERT_STATUS_H_
