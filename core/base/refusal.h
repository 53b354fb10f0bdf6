// Structured errors that a program can act on: reason, field, item, limit and requested value. A Refusal is a payload
// of absl::Status: intermediate layers pass it on unread, and the server converts it to the protocol's Error in one
// place. Pure functions; any thread.
#ifndef LOCUS_CORE_BASE_REFUSAL_H_
#define LOCUS_CORE_BASE_REFUSAL_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus {

// Reason of a refusal. The numeric values equal those of the protocol's Reason.
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
};
inline constexpr Reason kLastReason = Reason::kDamaged;

// Returns the name of a reason as in the protocol, such as "NOT_FINITE".
absl::string_view reason_name(Reason reason);

// Details of a refused request.
struct Refusal {
  Reason reason = Reason::kUnspecified;
  std::string field;  // path of the field, such as blocks[2].rays.directions; empty = the request as a whole
  std::optional<uint32_t> index;  // index of the item in the field
  std::string limit;              // name of the exceeded limit; empty = none
  double limit_value = 0;
  double asked = 0;             // requested value
  uint32_t retry_after_ms = 0;  // 0 = do not retry unchanged
};

// Returns a status of `code` that carries `refusal`. `message` should state what to do next; it is prefixed by
// `field[index]: `.
absl::Status refuse(absl::StatusCode code, absl::string_view message, const Refusal& refusal);

// Returns INVALID_ARGUMENT for `field`, or for its item `index` if one is given.
absl::Status refuse_argument(Reason reason, absl::string_view field, std::optional<uint32_t> index,
                             absl::string_view message);

// Returns INVALID_ARGUMENT naming the limit, its value and the requested value. For a request that exceeds the limit on
// its own, whatever the load: repeating it cannot succeed.
absl::Status refuse_limit(absl::string_view field, absl::string_view limit, double limit_value, double asked);

// Returns RESOURCE_EXHAUSTED naming the limit, its value and the requested value. For a server or scene that is full at
// present: the same request may succeed later. `retry_after_ms` is 0 if waiting alone does not help.
absl::Status refuse_full(absl::string_view field, absl::string_view limit, double limit_value, double asked,
                         uint32_t retry_after_ms);

// Returns the refusal that refuse() attached to `status`; nullopt if there is none.
std::optional<Refusal> refusal_of(const absl::Status& status);

}  // namespace locus

#endif  // LOCUS_CORE_BASE_REFUSAL_H_
