// Entry points that libFuzzer calls: the argument --target=NAME selects the target, which then runs for each input.
// libFuzzer itself ignores arguments that begin with two dashes.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iostream>

#include "absl/strings/strip.h"
#include "tests/fuzz/fuzz_target.h"

namespace {

const locus::fuzz::FuzzTarget* chosen = nullptr;

[[noreturn]] void list_targets() {
  std::cerr << "give --target=NAME, one of:";
  for (const locus::fuzz::FuzzTarget& target : locus::fuzz::targets()) std::cerr << ' ' << target.name;
  std::cerr << '\n';
  std::exit(2);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  absl::string_view name;
  for (int i = 1; i < *argc; ++i) {
    absl::string_view argument = (*argv)[i];
    if (absl::ConsumePrefix(&argument, "--target=")) name = argument;
  }
  for (const locus::fuzz::FuzzTarget& target : locus::fuzz::targets())
    if (target.name == name) chosen = &target;
  if (chosen == nullptr) list_targets();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  chosen->run({reinterpret_cast<const char*>(data), size});
  return 0;
}
