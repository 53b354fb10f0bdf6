// Registration of fuzz targets, and helpers that split one input into several pieces. A target is a function that feeds
// untrusted bytes to one reader of the product and verifies properties of the result with LOCUS_CHECK. The same source
// is linked into a libFuzzer program (fuzz_main.cc) and into the test that runs the committed seeds (seeds_test.cc).
// Targets keep no state between inputs and run on one thread.
#ifndef LOCUS_TESTS_FUZZ_FUZZ_TARGET_H_
#define LOCUS_TESTS_FUZZ_FUZZ_TARGET_H_

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/base/check.h"

namespace locus::fuzz {

struct FuzzTarget {
  const char* name;  // name of the target and of the folder with its seeds
  void (*run)(absl::string_view input);
};

// Returns all targets that are linked into the program.
inline std::vector<FuzzTarget>& targets() {
  static std::vector<FuzzTarget> all;
  return all;
}

struct Registration {
  Registration(const char* name, void (*run)(absl::string_view)) { targets().push_back({name, run}); }
};

// Defines the fuzz target `name`. The body of the function follows; `input` is its argument.
#define LOCUS_FUZZ_TARGET(name)                                                    \
  static void fuzz_##name(absl::string_view input);                                \
  static const ::locus::fuzz::Registration registered_##name(#name, &fuzz_##name); \
  static void fuzz_##name(absl::string_view input)

// Appends a piece that next_piece() returns. Pieces of more than 65535 bytes are cut.
inline void append_piece(std::string& input, absl::string_view piece) {
  const size_t size = std::min<size_t>(piece.size(), UINT16_MAX);
  input.push_back(static_cast<char>(size & 0xFF));
  input.push_back(static_cast<char>(size >> 8));
  input.append(piece.data(), size);
}

// Removes and returns the first piece of `input`: two bytes with its length, then the piece. If fewer bytes than this
// length are left, returns all of them. If the length is incomplete, returns an empty piece.
inline absl::string_view next_piece(absl::string_view& input) {
  if (input.size() < 2) {
    input = {};
    return {};
  }
  const size_t size = static_cast<uint8_t>(input[0]) | size_t{static_cast<uint8_t>(input[1])} << 8;
  const absl::string_view piece = input.substr(2, size);
  input.remove_prefix(2 + piece.size());
  return piece;
}

// Verifies that an error says what is wrong: it has a code that callers expect of bad input, and a message of limited
// length without control characters, which could change a terminal.
inline void check_error(const absl::Status& status) {
  constexpr size_t kMaxMessageBytes = 8192;
  LOCUS_CHECK(!status.ok());
  LOCUS_CHECK(!absl::IsInternal(status) && !absl::IsUnknown(status));
  LOCUS_CHECK_LT(0u, status.message().size());
  LOCUS_CHECK_LE(status.message().size(), kMaxMessageBytes);
  const bool printable = std::none_of(status.message().begin(), status.message().end(),
                                      [](char c) { return static_cast<uint8_t>(c) < 0x20 || c == 0x7F; });
  LOCUS_CHECK(printable);
}

}  // namespace locus::fuzz

#endif  // LOCUS_TESTS_FUZZ_FUZZ_TARGET_H_
