// Epochs of scenes: what names one unbroken count of revisions.
#ifndef LOCUS_SERVER_SERVICES_EPOCHS_H_
#define LOCUS_SERVER_SERVICES_EPOCHS_H_

#include <cstdint>

namespace locus::server {

// Never 0, and with all but certainty never the same twice, in this run of the server or another. Any thread.
uint64_t new_epoch();

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICES_EPOCHS_H_
