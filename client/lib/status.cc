#include "client/lib/status.h"

#include <string>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "client/lib/advice.h"
#include "grpcpp/support/status.h"

namespace locus::client {
namespace {

constexpr char kPayloadUrl[] = "type.googleapis.com/locus.v1.Error";
constexpr char kReadOnlyPayload[] = "locus/read-only";  // empty payload of mark_read_only()
constexpr int kLastCode = 16;                           // UNAUTHENTICATED

absl::StatusCode code_of(int code) {
  return code > 0 && code <= kLastCode ? static_cast<absl::StatusCode>(code) : absl::StatusCode::kUnknown;
}

// Converts a status without details, and appends advice to its message.
absl::Status with_advice(const grpc::Status& status) {
  const absl::StatusCode code = code_of(status.error_code());
  const std::string advice = advice_on(code, status.error_message());
  return {code, absl::StrCat(status.error_message(), advice.empty() ? "" : ": ", advice)};
}

void attach(const v1::Error& error, absl::Status& status) {
  status.SetPayload(kPayloadUrl, absl::Cord(error.SerializeAsString()));
}

}  // namespace

std::optional<v1::Error> error_of(const absl::Status& status) {
  const absl::optional<absl::Cord> payload = status.GetPayload(kPayloadUrl);
  v1::Error error;
  if (!payload || !error.ParseFromString(std::string(*payload))) return std::nullopt;
  return error;
}

absl::Status mark_read_only(absl::Status error) {
  error.SetPayload(kReadOnlyPayload, absl::Cord());
  return error;
}

bool is_read_only(const absl::Status& error) { return error.GetPayload(kReadOnlyPayload).has_value(); }

absl::Duration retry_after(const absl::Status& status) {
  const std::optional<v1::Error> error = error_of(status);
  return error ? absl::Milliseconds(error->retry_after_ms()) : absl::ZeroDuration();
}

bool refused_by_server(const absl::Status& status) {
  const std::optional<v1::Error> error = error_of(status);
  return error && error->reason() != v1::REASON_UNSPECIFIED;
}

absl::Status to_absl_status(const grpc::Status& status) {
  if (status.ok()) return absl::OkStatus();
  v1::Status details;
  if (status.error_details().empty() || !details.ParseFromString(status.error_details())) return with_advice(status);
  absl::Status result(code_of(status.error_code()), status.error_message());
  for (const google::protobuf::Any& detail : details.details()) {
    v1::Error error;
    if (detail.Is<v1::Error>() && detail.UnpackTo(&error)) {
      attach(error, result);
      break;
    }
  }
  return result;
}

absl::Status to_absl_status(const v1::Error& error) {
  absl::Status result(code_of(error.code()), error.message());
  attach(error, result);
  return result;
}

}  // namespace locus::client
