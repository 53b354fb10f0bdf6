// The program `locus-guests`: clients that run at the same time as the measured client. locus-bench starts it as
//   locus-guests bulk|silent|churn ADDRESS COUNT FILE
// where FILE has the message that each client sends, and the first argument is the kind of clients:
//   bulk    one client with COUNT messages in flight
//   silent  COUNT clients that never read their answers
//   churn   2 COUNT clients, at most COUNT at a time, that connect, send one query and leave
// With churn the program ends by itself; with the other kinds it must be ended by a signal. Silent and churn clients
// run at a lower priority, so that they take no processor time from the server, as if they ran on other machines.
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
