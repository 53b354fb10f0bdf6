// Filter of system calls, made with libseccomp, for the process that reads an untrusted file. For import_child.cc. Only
// syscall_filter.cc includes libseccomp. The function changes the calling process.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_SYSCALL_FILTER_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_SYSCALL_FILTER_H_

namespace locus::cli {

// Permanently restricts the system calls of the calling thread. The thread can still exit, write to `descriptor`, and
// use memory, clocks, random numbers, and its own locks and signals. Calls that libraries try but do not need (to open
// or read files, query their properties, write to other descriptors, or query limits) fail with EPERM. Any other call
// kills the process with SIGSYS. Returns false and changes nothing if the kernel does not support such filters, or in a
// sanitizer build, since a sanitizer needs other calls for its reports.
bool load_syscall_filter(int descriptor);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_SYSCALL_FILTER_H_
