#include "core/base/refusal.h"

#include <array>
#include <vector>

#include "absl/strings/cord.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "core/base/check.h"

namespace locus {
namespace {

constexpr absl::string_view kPayloadType = "locus/refusal";
// Separator of the payload's fields: a character that no field path or limit name contains.
constexpr char kSeparator = '\x1f';
constexpr size_t kFieldCount = 9;
// Separator of the addresses, which contain none.
constexpr char kAddressSeparator = '\x1e';

constexpr std::array<absl::string_view, 20> kReasonNames = {
    "UNSPECIFIED",     "NOT_FINITE",    "UNKNOWN_ID", "DUPLICATE_ID",   "COLUMN_LENGTH", "LIMIT",     "OUT_OF_RANGE",
    "SCENE_RESTARTED", "NOT_SERVED",    "NOT_FOUND",  "ALREADY_EXISTS", "DRAINING",      "MALFORMED", "BATCH_GAP",
    "IN_USE",          "HASH_MISMATCH", "RECOVERING", "DAMAGED",        "ELSEWHERE",     "NO_LEADER"};
static_assert(kReasonNames.size() == static_cast<size_t>(kLastReason) + 1 && !kReasonNames.back().empty());

// Formats a value. Integers of up to 2^53 are written without an exponent.
std::string formatted(double value) {
  constexpr double kExactIntegers = 9007199254740992.0;
  if (value >= -kExactIntegers && value <= kExactIntegers && value == static_cast<double>(static_cast<int64_t>(value)))
    return absl::StrCat(static_cast<int64_t>(value));
  return absl::StrCat(value);
}

// Returns the prefix of a message: "field[index]: ", "field: " without an index, "" without a field.
std::string location(const Refusal& refusal) {
  if (refusal.field.empty()) return "";
  if (!refusal.index) return absl::StrCat(refusal.field, ": ");
  return absl::StrCat(refusal.field, "[", *refusal.index, "]: ");
}

absl::Status over_limit(absl::StatusCode code, absl::string_view field, absl::string_view limit, double limit_value,
                        double asked, uint32_t retry_after_ms) {
  Refusal refusal;
  refusal.reason = Reason::kLimit;
  refusal.field = std::string(field);
  refusal.limit = std::string(limit);
  refusal.limit_value = limit_value;
  refusal.asked = asked;
  refusal.retry_after_ms = retry_after_ms;
  return refuse(code, absl::StrCat("limit ", limit, " is ", formatted(limit_value), ", asked for ", formatted(asked)),
                refusal);
}

}  // namespace

absl::string_view reason_name(Reason reason) {
  const auto value = static_cast<size_t>(reason);
  return value < kReasonNames.size() ? kReasonNames[value] : "UNKNOWN_REASON";
}

absl::Status refuse(absl::StatusCode code, absl::string_view message, const Refusal& refusal) {
  LOCUS_DCHECK(code != absl::StatusCode::kOk);
  LOCUS_DCHECK(!absl::StrContains(refusal.field, kSeparator));
  LOCUS_DCHECK(!absl::StrContains(refusal.limit, kSeparator));
  absl::Status status(code, absl::StrCat(location(refusal), message));
  const std::string index = refusal.index ? absl::StrCat(*refusal.index) : "";
  const std::string separator(1, kSeparator);
  status.SetPayload(
      kPayloadType,
      absl::Cord(absl::StrCat(static_cast<int>(refusal.reason), separator, refusal.field, separator, index, separator,
                              refusal.limit, separator) +
                 absl::StrCat(formatted(refusal.limit_value), separator, formatted(refusal.asked), separator,
                              refusal.retry_after_ms) +
                 absl::StrCat(separator, absl::StrJoin(refusal.addresses, absl::string_view(&kAddressSeparator, 1)),
                              separator, refusal.token)));
  return status;
}

absl::Status refuse_argument(Reason reason, absl::string_view field, std::optional<uint32_t> index,
                             absl::string_view message) {
  Refusal refusal;
  refusal.reason = reason;
  refusal.field = std::string(field);
  refusal.index = index;
  return refuse(absl::StatusCode::kInvalidArgument, message, refusal);
}

absl::Status refuse_limit(absl::string_view field, absl::string_view limit, double limit_value, double asked) {
  return over_limit(absl::StatusCode::kInvalidArgument, field, limit, limit_value, asked, 0);
}

absl::Status refuse_full(absl::string_view field, absl::string_view limit, double limit_value, double asked,
                         uint32_t retry_after_ms) {
  return over_limit(absl::StatusCode::kResourceExhausted, field, limit, limit_value, asked, retry_after_ms);
}

absl::Status no_scene(absl::string_view name) {
  Refusal refusal;
  refusal.reason = Reason::kNotFound;
  refusal.field = "scene";
  return refuse(absl::StatusCode::kNotFound, absl::StrCat("no scene is called '", name, "'; create it first"), refusal);
}

absl::Status no_leader(absl::string_view why, uint32_t retry_after_ms) {
  Refusal refusal;
  refusal.reason = Reason::kNoLeader;
  refusal.field = "scene";
  refusal.retry_after_ms = retry_after_ms;
  return refuse(absl::StatusCode::kUnavailable, absl::StrCat(why, "; try again in a moment"), refusal);
}

std::optional<Refusal> refusal_of(const absl::Status& status) {
  const absl::optional<absl::Cord> payload = status.GetPayload(kPayloadType);
  if (!payload) return std::nullopt;
  const std::vector<std::string> fields = absl::StrSplit(std::string(*payload), kSeparator);
  if (fields.size() != kFieldCount) return std::nullopt;
  Refusal refusal;
  int reason = 0;
  uint32_t index = 0;
  if (absl::SimpleAtoi(fields[0], &reason)) refusal.reason = static_cast<Reason>(reason);
  refusal.field = fields[1];
  if (absl::SimpleAtoi(fields[2], &index)) refusal.index = index;
  refusal.limit = fields[3];
  if (!absl::SimpleAtod(fields[4], &refusal.limit_value)) refusal.limit_value = 0;
  if (!absl::SimpleAtod(fields[5], &refusal.asked)) refusal.asked = 0;
  if (!absl::SimpleAtoi(fields[6], &refusal.retry_after_ms)) refusal.retry_after_ms = 0;
  if (!fields[7].empty()) refusal.addresses = absl::StrSplit(fields[7], kAddressSeparator);
  if (!absl::SimpleAtoi(fields[8], &refusal.token)) refusal.token = 0;
  return refusal;
}

}  // namespace locus
