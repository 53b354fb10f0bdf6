// What this process may use of its machine: processor cores and memory, by its affinity and by the control groups
// (version 1 or 2) that it runs in. For the defaults of an operator's options. Plain data, read once; the functions may
// be called from any thread.
#ifndef LOCUS_SERVER_CONFIG_MACHINE_H_
#define LOCUS_SERVER_CONFIG_MACHINE_H_

#include <cstdint>
#include <optional>
#include <string>

namespace locus::server {

struct CgroupLimits {
  std::optional<uint32_t> cores;         // processor time a period, rounded up to whole cores, at least 1
  std::optional<uint64_t> memory_bytes;  // the lowest of the group and all groups above it
};

// The limits of the groups that `root`/proc/self/cgroup names, each found under `root`/sys/fs/cgroup. A group that is
// not there, as in a container that sees its own group as the topmost, is passed over for the ones above it. What
// cannot be read limits nothing. `root` is empty for the machine itself.
CgroupLimits read_cgroup_limits(const std::string& root);

struct Machine {
  uint32_t cores = 1;         // at least 1
  uint64_t memory_bytes = 0;  // of the machine, or of the control group where that is less
};

// Cores: those of the affinity mask, at most as many as the groups give time for.
Machine read_machine();

}  // namespace locus::server

#endif  // LOCUS_SERVER_CONFIG_MACHINE_H_
