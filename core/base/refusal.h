// A refusal that a program can act on: what was wrong, in which field and item, which limit, and what was asked. It
// travels inside absl::Status as a payload, so that rooms pass it on without knowing it and the server's one error map
// turns it into the protocol's Error.
#ifndef LOCUS_CORE_BASE_REFUSAL_H_
#define LOCUS_CORE_BASE_REFUSAL_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace locus {

// Numbers equal those of the protocol's Reason.
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

// "NOT_FINITE" and so on: how messages and the command line print a reason.
absl::string_view reason_name(Reason reason);

struct Refusal {
  Reason reason = Reason::kUnspecified;
  std::string field;              // path, for example blocks[2].rays.directions; empty = the whole request
  std::optional<uint32_t> index;  // item within the field
  std::string limit;              // name of the limit hit, empty if none
  double limit_value = 0;
  double asked = 0;
  uint32_t retry_after_ms = 0;  // 0 = do not retry unchanged
};

// A status of `code` that carries `refusal`. The message should say what to do next; field and index are put in front
// of it as `field[index]: `.
absl::Status refuse(absl::StatusCode code, absl::string_view message, const Refusal& refusal);

// The common case: INVALID_ARGUMENT for one field, and one item where `index` is given.
absl::Status refuse_argument(Reason reason, absl::string_view field, std::optional<uint32_t> index,
                             absl::string_view message);

// A request that is over a limit all by itself: INVALID_ARGUMENT naming the limit, its value and what was asked.
absl::Status refuse_limit(absl::string_view field, absl::string_view limit, double limit_value, double asked);

// The server or scene is full now: RESOURCE_EXHAUSTED naming the limit. The same request may pass once something is
// freed; `retry_after_ms` is 0 where waiting alone frees nothing.
absl::Status refuse_full(absl::string_view field, absl::string_view limit, double limit_value, double asked,
                         uint32_t retry_after_ms);

// What refuse() attached; nothing for a status made without it.
std::optional<Refusal> refusal_of(const absl::Status& status);

}  // namespace locus

#endif  // LOCUS_CORE_BASE_REFUSAL_H_
