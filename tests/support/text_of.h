// Content of a file as a string, for tests.
#ifndef LOCUS_TESTS_SUPPORT_TEXT_OF_H_
#define LOCUS_TESTS_SUPPORT_TEXT_OF_H_

#include <fstream>
#include <sstream>
#include <string>

namespace locus::test {

// Returns the bytes of a file; an empty string if it cannot be read.
inline std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_TEXT_OF_H_
