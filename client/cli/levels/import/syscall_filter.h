// Filter of system calls for the process that reads an untrusted file, by libseccomp. For import_child.cc. The only
// file that includes libseccomp. Changes the calling process.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_SYSCALL_FILTER_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_SYSCALL_FILTER_H_

namespace locus::cli {

// Restricts the calling thread permanently to memory, clocks, its own end, and writing to `descriptor`. Calls that
// libraries try and can do without (opening and describing files, writing elsewhere, reading limits) fail with EPERM;
// any other call ends the process with SIGSYS. Returns false and changes nothing if the kernel has no such filter, or
// in a sanitizer build, whose reports need other calls.
bool load_syscall_filter(int descriptor);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_SYSCALL_FILTER_H_
