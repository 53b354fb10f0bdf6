#include "server/convert/status.h"

#include <random>
#include <string>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace locus::server {
namespace {

// Maximum size in bytes of an error's text. Peers refuse metadata of more than 8 KiB in total, and the metadata of a
// refused call contains the text three times.
constexpr size_t kMaxText = 1024;
constexpr uint32_t kDrainRetryMs = 1000;
constexpr uint32_t kRecoveryRetryMs = 200;

static_assert(static_cast<int>(kLastReason) == v1::Reason_MAX);
static_assert(static_cast<int>(Reason::kNoLeader) == v1::REASON_NO_LEADER);
static_assert(static_cast<int>(Reason::kHashMismatch) == v1::REASON_HASH_MISMATCH);
static_assert(static_cast<int>(Reason::kMalformed) == v1::REASON_MALFORMED);
static_assert(static_cast<int>(Reason::kNotServed) == v1::REASON_NOT_SERVED);
static_assert(static_cast<int>(Reason::kNotFinite) == v1::REASON_NOT_FINITE);

// Returns at most kMaxText bytes of `text`, cut between UTF-8 characters.
std::string cut(absl::string_view text) {
  if (text.size() <= kMaxText) return std::string(text);
  size_t end = kMaxText;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return std::string(text.substr(0, end));
}

// Returns `wait_ms` lengthened by up to a quarter, at random, so that clients that were refused together do not all
// come back together. 0, which means that waiting does not help, stays 0.
uint32_t lengthened(uint32_t wait_ms) {
  thread_local std::minstd_rand random{std::random_device{}()};
  return wait_ms + std::uniform_int_distribution<uint32_t>(0, wait_ms / 4)(random);
}

}  // namespace

v1::Error to_error(const absl::Status& status) {
  v1::Error error;
  error.set_code(static_cast<int>(status.code()));
  error.set_message(cut(status.message()));
  const std::optional<Refusal> refusal = refusal_of(status);
  if (!refusal) return error;
  error.set_reason(static_cast<v1::Reason>(refusal->reason));
  error.set_field(cut(refusal->field));
  if (refusal->index) error.set_index(*refusal->index);
  error.set_limit(refusal->limit);
  error.set_limit_value(refusal->limit_value);
  error.set_asked(refusal->asked);
  error.set_retry_after_ms(lengthened(refusal->retry_after_ms));
  for (const std::string& address : refusal->addresses) error.add_addresses(address);
  error.set_token(refusal->token);
  return error;
}

grpc::Status to_grpc(const absl::Status& status) {
  if (status.ok()) return grpc::Status::OK;
  const v1::Error error = to_error(status);
  v1::Status details;
  details.set_code(error.code());
  details.set_message(error.message());
  details.add_details()->PackFrom(error);
  return grpc::Status(static_cast<grpc::StatusCode>(status.code()), error.message(), details.SerializeAsString());
}

absl::Status not_served(absl::string_view field) {
  Refusal refusal;
  refusal.reason = Reason::kNotServed;
  refusal.field = std::string(field);
  return refuse(absl::StatusCode::kUnimplemented, "not served by this build; GetServer lists the features that are",
                refusal);
}

absl::Status unknown_enum(absl::string_view field, int number) {
  return refuse_argument(
      Reason::kMalformed, field, {},
      absl::StrCat("this build does not know the number ", number, " here; the schema lists the numbers"));
}

absl::Status draining() {
  Refusal refusal;
  refusal.reason = Reason::kDraining;
  refusal.retry_after_ms = kDrainRetryMs;
  return refuse(absl::StatusCode::kUnavailable, "the server is shutting down; try again elsewhere or later", refusal);
}

absl::Status recovering() {
  Refusal refusal;
  refusal.reason = Reason::kRecovering;
  refusal.retry_after_ms = kRecoveryRetryMs;
  return refuse(absl::StatusCode::kUnavailable,
                "the server is still recovering its scenes from the disk; try again in a moment", refusal);
}

absl::Status damaged_data(const char* field, const absl::Status& damage) {
  Refusal refusal;
  refusal.reason = Reason::kDamaged;
  refusal.field = field;
  const char* const advice =
      absl::StrContains(damage.message(), "locusd") ? "" : "; see `locusd check`, then `locusd repair` or a backup";
  return refuse(absl::StatusCode::kDataLoss, absl::StrCat(damage.message(), advice), refusal);
}

}  // namespace locus::server
