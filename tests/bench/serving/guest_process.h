// Arguments with which the cases start the program locus-guests: the kind of guests and their query. One thread.
#ifndef LOCUS_TESTS_BENCH_SERVING_GUEST_PROCESS_H_
#define LOCUS_TESTS_BENCH_SERVING_GUEST_PROCESS_H_

#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "locus/v1/query_service.pb.h"
#include "tests/bench/serving/daemon.h"
#include "tests/bench/serving/process.h"

namespace locus::bench::serving {

class GuestProgram {
 public:
  // Writes the guests' message to a file; start() runs the program. guest_program.cc explains `kind` and `guests` (its
  // COUNT).
  GuestProgram(const Daemon& daemon, const std::string& kind, size_t guests, const std::string& scene,
               const v1::QueryBatch& batch)
      : words_{"locus-guests", kind, daemon.address(), absl::StrCat(guests), folder_.file("message")},
        ends_(kind == "churn") {
    v1::StreamQueriesRequest message;
    message.set_scene(scene);
    *message.mutable_batch() = batch;
    std::ofstream file(folder_.file("message"), std::ios::binary);
    message.SerializeToOstream(&file);
  }

  absl::StatusOr<std::unique_ptr<Process>> start() const {
    return Process::start(program_beside("locus-guests"), words_, folder_.file("log"));
  }
  // Returns whether the program ends by itself; otherwise it must be killed.
  bool ends() const { return ends_; }
  std::string log() const { return text_of_file(folder_.file("log")); }

 private:
  const TemporaryFolder folder_;
  const std::vector<std::string> words_;
  const bool ends_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_GUEST_PROCESS_H_
