// The program `locus-guests`: callers who misbehave, or come by the hundred. Started by locus-bench, as
//   locus-guests silent|churn ADDRESS COUNT FILE
// where the file has the message that each of them sends. Churn ends by itself, silent readers with a signal. Runs at
// a lower priority, which takes nothing from the server's part: from machines of their own, guests would not compute
// on the cores that the server has.
#include <sys/resource.h>

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
  constexpr int kSteps = 10;
  setpriority(PRIO_PROCESS, 0, kSteps);
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
    std::cerr << "usage: locus-guests silent|churn ADDRESS COUNT FILE\n";
    return 2;
  }
  return locus::bench::serving::run_guests(argv[1], argv[2], count, message);
}
