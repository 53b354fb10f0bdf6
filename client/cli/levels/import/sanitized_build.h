// Constant that is true if the program is built with a sanitizer. The limits of the child process of an import are then
// relaxed: a sanitizer reserves more address space than any limit allows, and reports errors by system calls that the
// filter would forbid.
#ifndef LOCUS_CLIENT_CLI_LEVELS_IMPORT_SANITIZED_BUILD_H_
#define LOCUS_CLIENT_CLI_LEVELS_IMPORT_SANITIZED_BUILD_H_

namespace locus::cli {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitizedBuild = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
inline constexpr bool kSanitizedBuild = true;
#else
inline constexpr bool kSanitizedBuild = false;
#endif
#else
inline constexpr bool kSanitizedBuild = false;
#endif

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_LEVELS_IMPORT_SANITIZED_BUILD_H_
