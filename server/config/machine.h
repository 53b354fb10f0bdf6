// Processor cores and memory that this process may use, limited by its affinity and by the control groups (version 1 or
// 2) that it runs in. For the defaults of an operator's options. Plain data, read once; the functions may be called
// from any thread.
#ifndef LOCUS_SERVER_CONFIG_MACHINE_H_
#define LOCUS_SERVER_CONFIG_MACHINE_H_

#include <cstdint>
#include <optional>
#include <string>

namespace locus::server {

struct CgroupLimits {
  std::optional<uint32_t> cores;         // CPU quota / period, rounded up to whole cores, at least 1
  std::optional<uint64_t> memory_bytes;  // minimum over the group and all groups above it
};

// Returns the limits of the groups that `root`/proc/self/cgroup names, read from `root`/sys/fs/cgroup. If a group is
// missing there, as in a container that sees its own group as the topmost, the groups above it are used. A file that
// cannot be read sets no limit. `root` is empty for the machine itself.
CgroupLimits read_cgroup_limits(const std::string& root);

struct Machine {
  uint32_t cores = 1;         // at least 1
  uint64_t memory_bytes = 0;  // memory of the machine, or of the control group if that is less
};

// Returns the number of cores in the affinity mask, but at most the cores of the control group's quota, and the memory.
Machine read_machine();

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_MACHINE_H_
