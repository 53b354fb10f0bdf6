// Paths of the programs of this build, which are in the folder of the running test. No path is compiled in, so that the
// compiler cache serves every checkout.
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
