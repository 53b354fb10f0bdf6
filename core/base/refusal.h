// Structured errors that a program can act on: reason, field, item, limit and requested value. A Refusal is a payload
// of absl::Status: intermediate layers return the status without reading the payload, and the server converts the
// payload to the protocol's Error in one place. Pure functions; any thread.
#ifndef LOCUS_CORE_BASE_REFUSAL_H_
#define LOCUS_CORE_BASE_REFUSAL_H_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus {

// Reason of a refusal. The numeric values equal the values of the protocol's enum Reason.
enum class Reason : uint8_t {
  kUnspecified = 0,
  kNotFinite = 1,
  kUnknownId = 2,
  kDuplicateId = 3,
  kColumnLength = 4,
  kLimit = 5,
  kOutOfRange = 6,
  kSceneRestarted = 7,
  kNotServed = 8,
  kNotFound = 9,
  kAlreadyExists = 10,
  kDraining = 11,
  kMalformed = 12,
  kBatchGap = 13,
  kInUse = 14,
  kHashMismatch = 15,
  kRecovering = 16,
  kDamaged = 17,
  kElsewhere = 18,
  kNoLeader = 19,
};
inline constexpr Reason kLastReason = Reason::kNoLeader;

// Returns the name of a reason as in the protocol, such as "NOT_FINITE".
absl::string_view reason_name(Reason reason);

// Details of a refused request.
struct Refusal {
  Reason reason = Reason::kUnspecified;
  std::string field;  // path of the field, such as blocks[2].rays.directions; empty = the request as a whole
  std::optional<uint32_t> index;  // index of the item in a repeated field; nullopt = the whole field
  std::string limit;              // name of the exceeded limit; empty = the reason is not a limit
  double limit_value = 0;
  double asked = 0;                    // requested value
  uint32_t retry_after_ms = 0;         // 0 = repeating the same request does not help
  std::vector<std::string> addresses;  // of the servers that have the scene, for kElsewhere
  uint64_t token = 0;                  // number of the leadership of the first address
};

// Returns a status with the code `code` and `refusal` as payload. `message` should state what the caller can do next;
// in the status, `field[index]: ` precedes `message`.
absl::Status refuse(absl::StatusCode code, absl::string_view message, const Refusal& refusal);

// Returns INVALID_ARGUMENT for `field` or, if `index` is given, for the item of `field` at that index.
absl::Status refuse_argument(Reason reason, absl::string_view field, std::optional<uint32_t> index,
                             absl::string_view message);

// Returns INVALID_ARGUMENT naming the limit, its value and the requested value `asked`. Use this function for a request
// that is too large at any load of the server, so that repeating the request cannot succeed.
absl::Status refuse_limit(absl::string_view field, absl::string_view limit, double limit_value, double asked);

// Returns RESOURCE_EXHAUSTED naming the limit, its value and the requested value `asked`. Use this function for a
// request for which the server or the scene has no room at present; the same request may succeed later.
// `retry_after_ms` is 0 if waiting alone does not help.
absl::Status refuse_full(absl::string_view field, absl::string_view limit, double limit_value, double asked,
                         uint32_t retry_after_ms);

// Returns NOT_FOUND for the scene `name`. Used in two cases: the scene does not exist, or the caller has no right to
// see it. The text is the same in both cases, so that the caller cannot find out whether the scene exists.
absl::Status no_scene(absl::string_view name);

// Returns UNAVAILABLE, kNoLeader: no server leads the scene at present, or this one does not know which one does. `why`
// is the first part of the message.
absl::Status no_leader(absl::string_view why, uint32_t retry_after_ms);

// Returns the refusal that refuse() attached to `status`; nullopt if `status` has no refusal.
std::optional<Refusal> refusal_of(const absl::Status& status);

}  // namespace locus

#endif  // LOCUS_CORE_BASE_REFUSAL_H_
