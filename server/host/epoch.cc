#include "server/host/epoch.h"

#include <random>

namespace locus::server {

uint64_t new_epoch() {
  std::random_device device;
  uint64_t epoch = 0;
  while (epoch == 0) epoch = uint64_t{device()} << 32 | device();
  return epoch;
}

}  // namespace locus::server
