// Constant that is true if the program is built with a sanitizer, which replaces the allocator, reserves more address
// space than limits of tests and of child processes allow, and reports errors by system calls of its own.
#ifndef LOCUS_CORE_BASE_SANITIZED_BUILD_H_
#define LOCUS_CORE_BASE_SANITIZED_BUILD_H_

namespace locus {

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

}  // namespace locus

#endif  // LOCUS_CORE_BASE_SANITIZED_BUILD_H_
