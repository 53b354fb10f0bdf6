// Assertions of invariants and preconditions. A check fails only because of a bug in locus, never because of a user's
// mistake. The failure prints the condition, the operands of a comparison, the file and the line, and aborts the
// process. Errors of users and of the system are absl::Status instead. LOCUS_DCHECK* cost nothing in release builds.
// Any thread.
#ifndef LOCUS_CORE_BASE_CHECK_H_
#define LOCUS_CORE_BASE_CHECK_H_

#include <sstream>
#include <string>

namespace locus::internal {

// Prints the location, the failed condition and `operands` (may be empty) to stderr and aborts.
[[noreturn]] void check_failed(const char* file, int line, const char* condition, const std::string& operands);

template <class A, class B>
[[noreturn]] void check_failed_op(const char* file, int line, const char* condition, const A& a, const B& b) {
  std::ostringstream operands;
  operands << a << " and " << b;
  check_failed(file, line, condition, operands.str());
}

// Aborts unless compare(a, b) returns true. The operands are function parameters, so that temporaries in them live
// until the comparison ends. A macro with local references would not be safe: in LOCUS_CHECK_LE(x, std::min(y, 5)),
// std::min() may return a reference to a temporary, which a local reference does not keep alive.
template <class Compare, class A, class B>
constexpr void check_op(Compare compare, const A& a, const B& b, const char* file, int line, const char* condition) {
  if (!compare(a, b)) check_failed_op(file, line, condition, a, b);
}

}  // namespace locus::internal

#define LOCUS_CHECK(condition) \
  (static_cast<bool>(condition) ? void(0) : ::locus::internal::check_failed(__FILE__, __LINE__, #condition, ""))
#define LOCUS_CHECK_OP_(a, op, b)                                                                                    \
  ::locus::internal::check_op([](const auto& locus_a, const auto& locus_b) { return locus_a op locus_b; }, (a), (b), \
                              __FILE__, __LINE__, #a " " #op " " #b)
#define LOCUS_CHECK_EQ(a, b) LOCUS_CHECK_OP_(a, ==, b)
#define LOCUS_CHECK_NE(a, b) LOCUS_CHECK_OP_(a, !=, b)
#define LOCUS_CHECK_LE(a, b) LOCUS_CHECK_OP_(a, <=, b)
#define LOCUS_CHECK_LT(a, b) LOCUS_CHECK_OP_(a, <, b)

// True in debug and sanitizer builds, where LOCUS_DCHECK* are evaluated. Most mutable classes whose comment names an
// invariant have a member check_invariants(), which each mutating public member calls at its end through
// LOCUS_DCHECK_CALL. check_invariants() costs at most as much as the mutation.
namespace locus {
#ifdef NDEBUG
inline constexpr bool kDebugChecks = false;
#else
inline constexpr bool kDebugChecks = true;
#endif
}  // namespace locus

// Macros that are type-checked in every build but evaluated only if kDebugChecks is true.
#define LOCUS_DCHECK(condition)                                  \
  do {                                                           \
    if constexpr (::locus::kDebugChecks) LOCUS_CHECK(condition); \
  } while (false)
#define LOCUS_DCHECK_OP_(a, op, b)                                  \
  do {                                                              \
    if constexpr (::locus::kDebugChecks) LOCUS_CHECK_OP_(a, op, b); \
  } while (false)
#define LOCUS_DCHECK_EQ(a, b) LOCUS_DCHECK_OP_(a, ==, b)
#define LOCUS_DCHECK_NE(a, b) LOCUS_DCHECK_OP_(a, !=, b)
#define LOCUS_DCHECK_LE(a, b) LOCUS_DCHECK_OP_(a, <=, b)
#define LOCUS_DCHECK_LT(a, b) LOCUS_DCHECK_OP_(a, <, b)
#define LOCUS_DCHECK_GE(a, b) LOCUS_DCHECK_OP_(a, >=, b)
#define LOCUS_DCHECK_GT(a, b) LOCUS_DCHECK_OP_(a, >, b)

// Calls a function that verifies invariants, for example LOCUS_DCHECK_CALL(check_invariants()).
#define LOCUS_DCHECK_CALL(...)                        \
  do {                                                \
    if constexpr (::locus::kDebugChecks) __VA_ARGS__; \
  } while (false)

#endif  // LOCUS_CORE_BASE_CHECK_H_
