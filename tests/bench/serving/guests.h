// Callers beside the one who is measured: one with large batches all the time, many who never read what they asked for,
// and many who come, ask once and go. Each has a connection and a stream of its own; one thread drives them all. For
// the cases that look what they leave behind, in a program of their own: gRPC shares threads between the connections of
// a process, and who waits for an answer would do the work of the others.
#ifndef LOCUS_TESTS_BENCH_SERVING_GUESTS_H_
#define LOCUS_TESTS_BENCH_SERVING_GUESTS_H_

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "locus/v1/query_service.grpc.pb.h"
#include "tests/bench/serving/stream_load.h"

namespace locus::bench::serving {

// As many connections as the system lets this process have: each is a file.
void allow_many_files();

// Keeps so many messages under way, all the same.
class BulkCaller {
 public:
  BulkCaller(const std::string& address, size_t window, v1::StreamQueriesRequest message);

  // Some of them. Whatever goes wrong shows in status().
  void run();
  const absl::Status& status() const { return status_; }

 private:
  using Load = StreamLoad<v1::StreamQueriesRequest, v1::StreamQueriesResponse>;

  const size_t window_;
  v1::StreamQueriesRequest message_;
  std::unique_ptr<Load> stream_;
  absl::Status status_;
};

// They write until nothing more is taken from them, and read nothing.
class SilentReaders {
 public:
  // Borrows the message.
  SilentReaders(const std::string& address, size_t count, const v1::StreamQueriesRequest& message);
  // They vanish.
  ~SilentReaders();
  SilentReaders(const SilentReaders&) = delete;
  SilentReaders& operator=(const SilentReaders&) = delete;

  // Until none has been able to write for a while.
  void write_until_stuck();

 private:
  struct Guest;

  const v1::StreamQueriesRequest& message_;
  grpc::CompletionQueue queue_;
  std::vector<std::unique_ptr<Guest>> guests_;
};

// They come until so many are there; then the one who has been there the longest goes for each that comes, by turns in
// an orderly way and by breaking off. All have gone at the end.
class Churn {
 public:
  // Borrows the message.
  Churn(const std::string& address, size_t at_once, const v1::StreamQueriesRequest& message);
  ~Churn();
  Churn(const Churn&) = delete;
  Churn& operator=(const Churn&) = delete;

  // Until `guests` have come and gone. Whatever goes wrong shows in status().
  void run(size_t guests);
  const absl::Status& status() const { return status_; }

 private:
  struct Guest;

  bool invite();
  bool next_event();
  void go_on(Guest& guest, bool ok);
  void send_away(Guest& guest);
  void forget(Guest& guest);

  const std::string address_;
  const size_t at_once_;
  const v1::StreamQueriesRequest& message_;
  grpc::CompletionQueue queue_;
  std::deque<std::unique_ptr<Guest>> guests_;  // in the order in which they came
  size_t came_ = 0, coming_ = 0, staying_ = 0;
  absl::Status status_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_GUESTS_H_
