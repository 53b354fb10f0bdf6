// Numbers that name the unbroken sequences of revisions of scenes. Any thread.
#ifndef LOCUS_SERVER_HOST_EPOCH_H_
#define LOCUS_SERVER_HOST_EPOCH_H_

#include <cstdint>

namespace locus::server {

// Returns a new epoch: a random 64-bit number from std::random_device, never 0. An epoch names one unbroken sequence of
// revisions. Equal epochs are practically impossible, also between runs of the server.
uint64_t new_epoch();

}  // namespace locus::server

#endif  // LOCUS_SERVER_HOST_EPOCH_H_
