// Epochs of scenes. An epoch is a random number that names one unbroken count of revisions.
#ifndef LOCUS_SERVER_SERVICES_EPOCHS_H_
#define LOCUS_SERVER_SERVICES_EPOCHS_H_

#include <cstdint>

namespace locus::server {

// Returns a random number that is not 0: 64 bits of std::random_device, so equal epochs are practically impossible,
// also between runs of the server. Any thread.
uint64_t new_epoch();

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_EPOCHS_H_
