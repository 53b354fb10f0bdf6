// Processor time of a client and of its server while they exchange messages, to show how much of a measured time the
// client takes. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_PROCESSOR_TIME_H_
#define LOCUS_TESTS_BENCH_SERVING_PROCESSOR_TIME_H_

#include <sys/types.h>

#include <string>

#include "absl/strings/str_format.h"
#include "tests/bench/frame/race.h"
#include "tests/bench/serving/process.h"

namespace locus::bench::serving {

class ProcessorTime {
 public:
  // Measures this process as the client, and the process `server`.
  explicit ProcessorTime(pid_t server) : server_(server) {}

  // Measures `run`, which sends `messages` messages and receives their answers.
  template <class Run>
  void during(size_t messages, const Run& run) {
    const double here = process_seconds(), there = cpu_seconds_of(server_);
    run();
    here_ += process_seconds() - here;
    there_ += cpu_seconds_of(server_) - there;
    messages_ += messages;
  }

  // Processor time in microseconds per message.
  double client() const { return 1e6 * here_ / static_cast<double>(messages_); }
  double server() const { return 1e6 * there_ / static_cast<double>(messages_); }
  std::string text() const { return absl::StrFormat("client %.1f us, server %.1f us", client(), server()); }

 private:
  const pid_t server_;
  double here_ = 0, there_ = 0;
  size_t messages_ = 0;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_PROCESSOR_TIME_H_
