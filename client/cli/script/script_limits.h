// Limits of the size of a script and of the work it causes. For the parser and the runner of scripts. The error for an
// exceeded limit contains the limit's value.
#ifndef LOCUS_CLIENT_CLI_SCRIPT_SCRIPT_LIMITS_H_
#define LOCUS_CLIENT_CLI_SCRIPT_SCRIPT_LIMITS_H_

#include <cstddef>
#include <cstdint>

namespace locus::cli {

inline constexpr size_t kMaxScriptBytes = size_t{16} << 20;
inline constexpr size_t kMaxScriptLines = 100'000;
inline constexpr size_t kMaxLineBytes = 65'536;
inline constexpr size_t kMaxBlockNesting = 16;
inline constexpr uint64_t kMaxRepeats = 100'000;
// Maximum number of lines that run; a line in a loop counts each time.
inline constexpr uint64_t kMaxLinesRun = 1'000'000;
inline constexpr size_t kMaxVariables = 1'000;
// Maximum size of a word or text after substitution.
inline constexpr size_t kMaxTextBytes = size_t{1} << 20;
// Maximum nesting of parentheses, indexes, calls and quoted texts; the parser of expressions recurses at most this
// deep.
inline constexpr int kMaxExpressionDepth = 64;
inline constexpr double kMaxSleepSeconds = 3600;

static_assert(kMaxLineBytes <= kMaxTextBytes, "a line without variables fits a text");
static_assert(kMaxRepeats <= kMaxLinesRun);

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_SCRIPT_SCRIPT_LIMITS_H_
