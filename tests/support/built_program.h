// The programs of this build, which stand beside the tests. No path is compiled in: a compiler's cache then serves
// every checkout.
#ifndef LOCUS_TESTS_SUPPORT_BUILT_PROGRAM_H_
#define LOCUS_TESTS_SUPPORT_BUILT_PROGRAM_H_

#include <filesystem>
#include <string>

namespace locus::test {

inline std::string built_program(const std::string& name) {
  return std::filesystem::read_symlink("/proc/self/exe").replace_filename(name).string();
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_BUILT_PROGRAM_H_
