#include "client/cli/levels/import/syscall_filter.h"

#include <seccomp.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <type_traits>

#include "core/base/sanitized_build.h"

namespace locus::cli {
namespace {

struct ReleaseFilter {
  void operator()(void* filter) const { seccomp_release(filter); }
};
using Filter = std::unique_ptr<std::remove_pointer_t<scmp_filter_ctx>, ReleaseFilter>;

// System calls that are always allowed. They concern memory, clocks, random numbers, locks, signal handlers and the
// exit of the process. A filter cannot inspect memory behind pointer arguments, but none of these calls reaches a file,
// another process or the network.
constexpr int kAllowed[] = {SCMP_SYS(munmap),          SCMP_SYS(mremap),       SCMP_SYS(brk),
                            SCMP_SYS(madvise),         SCMP_SYS(futex),        SCMP_SYS(clock_gettime),
                            SCMP_SYS(gettimeofday),    SCMP_SYS(getrandom),    SCMP_SYS(getpid),
                            SCMP_SYS(gettid),          SCMP_SYS(sched_yield),  SCMP_SYS(rt_sigprocmask),
                            SCMP_SYS(rt_sigaction),    SCMP_SYS(rt_sigreturn), SCMP_SYS(sysinfo),
                            SCMP_SYS(restart_syscall), SCMP_SYS(exit),         SCMP_SYS(exit_group)};

// System calls that fail with EPERM instead of killing the process. The C library tries them, for example to choose the
// size of a buffer or to print why it aborts, and continues if they fail.
constexpr int kRefused[] = {SCMP_SYS(open),      SCMP_SYS(openat),     SCMP_SYS(stat),   SCMP_SYS(fstat),
                            SCMP_SYS(lstat),     SCMP_SYS(newfstatat), SCMP_SYS(statx),  SCMP_SYS(access),
                            SCMP_SYS(faccessat), SCMP_SYS(readlink),   SCMP_SYS(ioctl),  SCMP_SYS(lseek),
                            SCMP_SYS(read),      SCMP_SYS(close),      SCMP_SYS(writev), SCMP_SYS(sched_getaffinity),
                            SCMP_SYS(prlimit64), SCMP_SYS(getrlimit)};

// Adds a rule for a call. The rule applies only if all arguments in `conditions` have the given values.
bool add_rule(scmp_filter_ctx filter, uint32_t action, int call, std::initializer_list<scmp_arg_cmp> conditions) {
  const auto count = static_cast<unsigned>(conditions.size());
  return seccomp_rule_add_array(filter, action, call, count, conditions.begin()) == 0;
}

bool add_rules(scmp_filter_ctx filter, int descriptor) {
  constexpr uint32_t kRefuse = SCMP_ACT_ERRNO(EPERM);
  bool added = true;
  for (const int call : kAllowed) added &= add_rule(filter, SCMP_ACT_ALLOW, call, {});
  for (const int call : kRefused) added &= add_rule(filter, kRefuse, call, {});
  const auto number = static_cast<scmp_datum_t>(descriptor);
  added &= add_rule(filter, SCMP_ACT_ALLOW, SCMP_SYS(write), {{0, SCMP_CMP_EQ, number, 0}});
  added &= add_rule(filter, kRefuse, SCMP_SYS(write), {{0, SCMP_CMP_NE, number, 0}});
  // Allow mmap() and mprotect() only without execution rights, and mmap() only for memory that belongs to no file.
  const scmp_arg_cmp no_exec = {2, SCMP_CMP_MASKED_EQ, PROT_EXEC, 0};
  const scmp_arg_cmp no_file = {3, SCMP_CMP_MASKED_EQ, MAP_ANONYMOUS, MAP_ANONYMOUS};
  added &= add_rule(filter, SCMP_ACT_ALLOW, SCMP_SYS(mmap), {no_exec, no_file});
  added &= add_rule(filter, SCMP_ACT_ALLOW, SCMP_SYS(mprotect), {no_exec});
  // Allow signals to the process itself, because abort() sends one.
  const auto own = static_cast<scmp_datum_t>(getpid());
  added &= add_rule(filter, SCMP_ACT_ALLOW, SCMP_SYS(tgkill), {{0, SCMP_CMP_EQ, own, 0}});
  return added;
}

}  // namespace

bool load_syscall_filter(int descriptor) {
  if (kSanitizedBuild) return false;
  const Filter filter(seccomp_init(SCMP_ACT_KILL_PROCESS));
  return filter != nullptr && add_rules(filter.get(), descriptor) && seccomp_load(filter.get()) == 0;
}

}  // namespace locus::cli
