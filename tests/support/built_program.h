// Paths of the programs of this build. The programs are in the folder of the running test. The paths are not compiled
// in, so that checkouts in different folders share the entries of the compiler cache.
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
