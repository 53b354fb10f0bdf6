// Macros that return an error to the caller: RETURN_IF_ERROR and ASSIGN_OR_RETURN. The names have no prefix and could
// collide with macros of users, so headers that are installed must not include this file.
#ifndef LOCUS_CORE_BASE_STATUS_MACROS_H_
#define LOCUS_CORE_BASE_STATUS_MACROS_H_

#include <utility>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

// Evaluates an expression of type absl::Status and returns the status from the calling function unless it is OK.
#define RETURN_IF_ERROR(...)                                                                \
  do {                                                                                      \
    if (absl::Status locus_status = (__VA_ARGS__); !locus_status.ok()) return locus_status; \
  } while (false)

// Evaluates an expression of type absl::StatusOr<T>. If the result is an error, returns its status from the calling
// function. If the result is a value, moves the value into `declaration`. The macro expands to several statements, so
// put braces around it if it is the body of an `if` or a loop. Example: ASSIGN_OR_RETURN(const Level level,
// read_level(path)).
#define ASSIGN_OR_RETURN(declaration, ...) \
  LOCUS_ASSIGN_OR_RETURN_(LOCUS_JOIN_(locus_status_or_, __LINE__), declaration, __VA_ARGS__)

#define LOCUS_JOIN_(a, b) LOCUS_JOIN_AGAIN_(a, b)
#define LOCUS_JOIN_AGAIN_(a, b) a##b
#define LOCUS_ASSIGN_OR_RETURN_(result, declaration, ...) \
  auto result = (__VA_ARGS__);                            \
  if (!result.ok()) return std::move(result).status();    \
  declaration = *std::move(result)

#endif  // LOCUS_CORE_BASE_STATUS_MACROS_H_
