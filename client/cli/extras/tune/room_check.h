// Check that the limits and quotas of a server allow the scratch scenes of `locus tune`. A function without state.
#ifndef LOCUS_CLIENT_CLI_EXTRAS_TUNE_ROOM_CHECK_H_
#define LOCUS_CLIENT_CLI_EXTRAS_TUNE_ROOM_CHECK_H_

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "client/lib/client.h"

namespace locus::cli {

// Needs of the scratch scenes that exist at the same time.
struct ScratchNeed {
  uint64_t scenes = 0;
  uint64_t objects = 0;  // of all scenes together
  uint64_t bytes = 0;    // of all scenes together
};

// Returns RESOURCE_EXHAUSTED, with the needed and the free amount, if the scenes do not fit into the memory or the
// number of scenes of the server, or into a quota of the caller. If the server hides its use, only its limits count.
absl::Status check_room(const ScratchNeed& need, const v1::GetServerResponse& server,
                        absl::Span<const v1::IdentityQuotas> quotas);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_EXTRAS_TUNE_ROOM_CHECK_H_
