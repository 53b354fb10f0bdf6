#include "server/config/machine.h"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <thread>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/base/check.h"

namespace locus::server {
namespace {

constexpr const char* kGroups = "/sys/fs/cgroup";
// Maximum nesting depth of control groups. More deeply nested groups are not read.
constexpr int kMaxDepth = 64;

// Returns the words of a file's first line; an empty list if the file cannot be read.
std::vector<std::string> first_line(const std::string& path) {
  std::string line;
  std::ifstream file(path);
  if (!std::getline(file, line)) return {};
  return absl::StrSplit(line, ' ', absl::SkipEmpty());
}

std::optional<uint64_t> number(const std::vector<std::string>& words, size_t at) {
  uint64_t value = 0;
  if (at >= words.size() || !absl::SimpleAtoi(words[at], &value)) return std::nullopt;
  return value;
}

template <class T>
void lower(std::optional<T>& limit, std::optional<T> other) {
  if (other && (!limit || *other < *limit)) limit = other;
}

std::optional<uint32_t> cores_of(std::optional<uint64_t> quota, std::optional<uint64_t> period) {
  if (!quota || !period || *quota == 0 || *period == 0) return std::nullopt;
  const double cores = std::ceil(static_cast<double>(*quota) / static_cast<double>(*period));
  return static_cast<uint32_t>(std::min(cores, 65536.0));
}

// Calls `visit` with the folder of the control group `group` below `top`, then with the folder of each group above it,
// ending with `top`.
void climb(const std::string& top, std::string group, const std::function<void(const std::string&)>& visit) {
  if (absl::StrContains(group, "..")) group.clear();  // the group is outside of the groups that this process sees
  for (int depth = 0; depth < kMaxDepth && group.size() > 1; ++depth) {
    visit(absl::StrCat(top, group));
    group.resize(std::min(group.find_last_of('/'), group.size() - 1));
  }
  visit(top);
}

void read_version_2(const std::string& top, const std::string& group, CgroupLimits& limits) {
  climb(top, group, [&limits](const std::string& folder) {
    lower(limits.memory_bytes, number(first_line(folder + "/memory.max"), 0));
    const std::vector<std::string> time = first_line(folder + "/cpu.max");
    lower(limits.cores, cores_of(number(time, 0), number(time, 1)));
  });
}

void read_version_1(const std::string& top, const std::string& group, CgroupLimits& limits) {
  climb(top, group, [&limits](const std::string& folder) {
    lower(limits.memory_bytes, number(first_line(folder + "/memory.limit_in_bytes"), 0));
    lower(limits.cores, cores_of(number(first_line(folder + "/cpu.cfs_quota_us"), 0),
                                 number(first_line(folder + "/cpu.cfs_period_us"), 0)));
  });
}

}  // namespace

CgroupLimits read_cgroup_limits(const std::string& root) {
  CgroupLimits limits;
  const std::string groups = root + kGroups;
  std::ifstream file(root + "/proc/self/cgroup");
  // Each line is `number:controllers:group`. The line of version 2 has the number 0 and no controllers.
  for (std::string line; std::getline(file, line);) {
    const std::vector<std::string> parts = absl::StrSplit(line, absl::MaxSplits(':', 2));
    if (parts.size() != 3) continue;
    const std::string& group = parts[2];
    if (parts[1].empty()) {
      read_version_2(groups, group, limits);
      read_version_2(groups + "/unified", group, limits);
      continue;
    }
    const std::vector<std::string> controllers = absl::StrSplit(parts[1], ',');
    for (const std::string& controller : controllers)
      if (controller == "memory" || controller == "cpu")
        for (const std::string& folder : {parts[1], controller})
          read_version_1(absl::StrCat(groups, "/", folder), group, limits);
  }
  return limits;
}

Machine read_machine() {
  Machine machine;
  cpu_set_t set;
  CPU_ZERO(&set);
  const int count = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : 0;
  machine.cores = count > 0 ? static_cast<uint32_t>(count) : std::max(1u, std::thread::hardware_concurrency());
  machine.memory_bytes = static_cast<uint64_t>(std::max(0L, sysconf(_SC_PHYS_PAGES))) *
                         static_cast<uint64_t>(std::max(0L, sysconf(_SC_PAGESIZE)));
  const CgroupLimits limits = read_cgroup_limits("");
  machine.cores = std::min(machine.cores, limits.cores.value_or(machine.cores));
  machine.memory_bytes = std::min(machine.memory_bytes, limits.memory_bytes.value_or(machine.memory_bytes));
  LOCUS_DCHECK_LE(1u, machine.cores);
  return machine;
}

}  // namespace locus::server
