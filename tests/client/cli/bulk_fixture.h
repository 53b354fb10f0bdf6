// Fixture for bulk input against a real locusd: one daemon per test, command lines run in this process, and a pipe that
// a test writes to while a command reads from it.
#ifndef LOCUS_TESTS_CLIENT_CLI_BULK_FIXTURE_H_
#define LOCUS_TESTS_CLIENT_CLI_BULK_FIXTURE_H_

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/run.h"
#include "tests/client/cli/rows/bulk/test_input.h"
#include "tests/support/daemon_process.h"

namespace locus::cli {

struct BulkOutcome {
  ExitCode code;
  std::string out;
  std::string err;
};

class BulkTest : public ::testing::Test {
 protected:
  BulkTest()
      : daemon_({"--listen", "127.0.0.1:0", "--port-file", folder_.file("port")}, folder_.file("log")),
        address_("127.0.0.1:" + std::to_string(test::DaemonProcess::wait_for_port(folder_.file("port")))) {}

  void SetUp() override { ASSERT_EQ(run({"scene", "create", "world"}).code, ExitCode::kOk); }

  ExitCode run_into(std::vector<std::string> line, std::ostream& out, std::ostream& err) const {
    line.insert(line.begin(), {"--address", address_});
    Context context(out, err, Progress::kSilent);
    return run_line(line, context);
  }
  BulkOutcome run(const std::vector<std::string>& line) const {
    std::ostringstream out;
    std::ostringstream err;
    const ExitCode code = run_into(line, out, err);
    return {code, out.str(), err.str()};
  }
  // Runs a command line, expects that it succeeds, and returns its output.
  std::string out_of(const std::vector<std::string>& line) const {
    const BulkOutcome outcome = run(line);
    EXPECT_EQ(outcome.code, ExitCode::kOk) << outcome.err;
    return outcome.out;
  }
  Json json_of(std::vector<std::string> line) const {
    line.insert(line.begin(), {"-o", "json"});
    return Json::parse(out_of(line), nullptr, /*allow_exceptions=*/false);
  }

 private:
  test::TemporaryFolder folder_;
  test::DaemonProcess daemon_;
  std::string address_;
};

// Named pipe, created by the constructor, to which a test writes.
class NamedPipe {
 public:
  NamedPipe() : path_(TestFile::path_of("pipe")) { EXPECT_EQ(mkfifo(path_.c_str(), 0600), 0); }
  ~NamedPipe() { std::remove(path_.c_str()); }
  NamedPipe(const NamedPipe&) = delete;
  NamedPipe& operator=(const NamedPipe&) = delete;

  const std::string& path() const { return path_; }
  // Writes to the pipe. The first call waits until a reader opens the pipe.
  void write(const std::string& bytes) {
    if (!file_.is_open()) file_.open(path_);
    file_ << bytes << std::flush;
  }
  void close() { file_.close(); }

 private:
  std::string path_;
  std::ofstream file_;
};

// Stream buffer that collects the output of one thread while another thread waits for a text in it.
class SharedText : public std::streambuf {
 public:
  // Waits until `part` is in the output. Returns false after a minute.
  bool wait_for(const std::string& part) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::minutes(1), [&] { return text_.find(part) != std::string::npos; });
  }
  std::string text() {
    std::lock_guard lock(mutex_);
    return text_;
  }

 protected:
  std::streamsize xsputn(const char* bytes, std::streamsize count) override {
    std::lock_guard lock(mutex_);
    text_.append(bytes, static_cast<size_t>(count));
    changed_.notify_all();
    return count;
  }
  int_type overflow(int_type c) override {
    const char byte = traits_type::to_char_type(c);
    xsputn(&byte, 1);
    return c;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string text_;
};

}  // namespace locus::cli

#endif  // LOCUS_TESTS_CLIENT_CLI_BULK_FIXTURE_H_
