// The program `locus-guests`: another client with much to ask, callers who misbehave, or who come by the hundred.
// Started by locus-bench, as
//   locus-guests bulk|silent|churn ADDRESS COUNT FILE
// where the file has the message that each of them sends. Bulk is one client with COUNT messages under way. Churn ends
// by itself, the others with a signal. Those who misbehave run at a lower priority, which takes nothing from the
// server's part: from machines of their own, they would not compute on the cores that the server has.
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>

#include "absl/strings/numbers.h"
#include "tests/bench/serving/guests.h"

namespace locus::bench::serving {
namespace {

int run_guests(const std::string& kind, const std::string& address, size_t count,
               const v1::StreamQueriesRequest& message) {
  if (kind == "bulk") {
    BulkCaller caller(address, count, message);
    while (caller.status().ok()) caller.run();
    std::cerr << caller.status() << "\n";
    return EXIT_FAILURE;
  }
  constexpr int kSteps = 10;
  if (nice(kSteps) == -1) std::cerr << "not at a lower priority\n";
  allow_many_files();
  if (kind == "silent") {
    SilentReaders guests(address, count, message);
    while (true) guests.write_until_stuck();
  }
  Churn guests(address, count, message);
  guests.run(2 * count);
  if (!guests.status().ok()) std::cerr << guests.status() << "\n";
  return guests.status().ok() ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace
}  // namespace locus::bench::serving

int main(int argc, char** argv) {
  locus::v1::StreamQueriesRequest message;
  size_t count = 0;
  std::ifstream file(argc == 5 ? argv[4] : "", std::ios::binary);
  if (argc != 5 || !absl::SimpleAtoi(argv[3], &count) || !message.ParseFromIstream(&file)) {
    std::cerr << "usage: locus-guests bulk|silent|churn ADDRESS COUNT FILE\n";
    return 2;
  }
  return locus::bench::serving::run_guests(argv[1], argv[2], count, message);
}
