// The only map between the house's errors (absl::Status with a Refusal) and the protocol's (grpc::Status with a
// locus.v1.Error in its details). Pure functions.
#ifndef LOCUS_SERVER_CONVERT_STATUS_H_
#define LOCUS_SERVER_CONVERT_STATUS_H_

#include <grpcpp/support/status.h>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/base/refusal.h"
#include "locus/v1/errors.pb.h"

namespace locus::server {

// What a refused message of a stream is answered with. `status` is not OK. Texts that a caller could blow up are cut
// to what fits into metadata.
v1::Error to_error(const absl::Status& status);

// What a refused call ends with: the details hold a locus.v1.Status with one Error. OK stays OK.
grpc::Status to_grpc(const absl::Status& status);

// UNIMPLEMENTED, REASON_NOT_SERVED: `field` is in the schema, but this build does not serve it.
absl::Status not_served(absl::string_view field);

// INVALID_ARGUMENT, REASON_MALFORMED for a number that an enum of the schema does not have.
absl::Status unknown_enum(absl::string_view field, int number);

// UNAVAILABLE, REASON_DRAINING.
absl::Status draining();

// UNAVAILABLE, REASON_RECOVERING.
absl::Status recovering();

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONVERT_STATUS_H_
