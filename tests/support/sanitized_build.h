// Constant that is true if the tests are built with a sanitizer, which replaces the allocator and takes much memory.
#ifndef LOCUS_TESTS_SUPPORT_SANITIZED_BUILD_H_
#define LOCUS_TESTS_SUPPORT_SANITIZED_BUILD_H_

namespace locus::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitizedBuild = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool kSanitizedBuild = true;
#else
inline constexpr bool kSanitizedBuild = false;
#endif
#else
inline constexpr bool kSanitizedBuild = false;
#endif

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_SANITIZED_BUILD_H_
