// Processor cores and memory that this process may use, limited by its affinity and by the control groups (version 1 or
// 2) that it runs in. The defaults of the options `threads` and `memory-limit` are derived from these numbers. Plain
// data, read once; the functions may be called from any thread.
#ifndef LOCUS_SERVER_CONFIG_MACHINE_H_
#define LOCUS_SERVER_CONFIG_MACHINE_H_

#include <cstdint>
#include <optional>
#include <string>

namespace locus::server {

// Limits of the control groups of this process; no value if no group sets the limit.
struct CgroupLimits {
  std::optional<uint32_t> cores;         // CPU quota divided by its period, rounded up to whole cores, at least 1
  std::optional<uint64_t> memory_bytes;  // minimum of the limits of the group and all groups above it
};

// Returns the limits of the groups that the file `root`/proc/self/cgroup lists, read from `root`/sys/fs/cgroup. `root`
// is empty for this machine; tests pass a folder. The folder of a group can be missing in a container, which sees its
// own group as the topmost group; then only the groups above the missing folder are read. A file that cannot be read
// sets no limit.
CgroupLimits read_cgroup_limits(const std::string& root);

struct Machine {
  uint32_t cores = 1;         // at least 1
  uint64_t memory_bytes = 0;  // memory of the machine, or of the control group if that is less
};

// Returns the number of cores and the memory that this process may use. The number of cores is the number in the
// affinity mask or the control group's quota, whichever is less.
Machine read_machine();

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_MACHINE_H_
