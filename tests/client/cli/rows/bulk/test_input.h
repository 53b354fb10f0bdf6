// Temporary files with given bytes, for tests of bulk input.
#ifndef LOCUS_TESTS_CLIENT_CLI_ROWS_BULK_TEST_INPUT_H_
#define LOCUS_TESTS_CLIENT_CLI_ROWS_BULK_TEST_INPUT_H_

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <string>

namespace locus::cli {

// File of the running test, removed by the destructor.
class TestFile {
 public:
  explicit TestFile(const std::string& bytes, const std::string& name = "rows.csv") : path_(path_of(name)) {
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  ~TestFile() { std::remove(path_.c_str()); }
  TestFile(const TestFile&) = delete;
  TestFile& operator=(const TestFile&) = delete;

  const std::string& path() const { return path_; }

  static std::string path_of(const std::string& name) {
    const auto* const test = ::testing::UnitTest::GetInstance()->current_test_info();
    return ::testing::TempDir() + "locus_" + std::to_string(getpid()) + "_" + test->name() + "_" + name;
  }

 private:
  std::string path_;
};

}  // namespace locus::cli

#endif  // LOCUS_TESTS_CLIENT_CLI_ROWS_BULK_TEST_INPUT_H_
