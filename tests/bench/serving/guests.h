// Clients that run at the same time as the measured client: one with large batches all the time, many that never read
// their answers, and many that connect, send one query and leave. Each client has a connection and a stream of its own;
// one thread drives all clients. They run in a separate program, since gRPC shares threads between the connections of a
// process: in one process, the measured client would do work of the other clients while it waits.
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

// Raises this process's limit of open files, which bounds the number of connections, to the maximum that the system
// allows.
void allow_many_files();

// Client that keeps a fixed number of equal messages in flight.
class BulkCaller {
 public:
  BulkCaller(const std::string& address, size_t window, v1::StreamQueriesRequest message);

  // Sends 64 messages and waits for their answers. Errors are stored in status().
  void run();
  const absl::Status& status() const { return status_; }

 private:
  using Load = StreamLoad<v1::StreamQueriesRequest, v1::StreamQueriesResponse>;

  const size_t window_;
  v1::StreamQueriesRequest message_;
  std::unique_ptr<Load> stream_;
  absl::Status status_;
};

// Clients that write until flow control stops them, and read nothing.
class SilentReaders {
 public:
  // Connects `count` clients. Borrows the message.
  SilentReaders(const std::string& address, size_t count, const v1::StreamQueriesRequest& message);
  // Cancels the calls and closes the connections.
  ~SilentReaders();
  SilentReaders(const SilentReaders&) = delete;
  SilentReaders& operator=(const SilentReaders&) = delete;

  // Writes messages; returns when flow control has stopped all clients for a while.
  void write_until_stuck();

 private:
  struct Guest;

  const v1::StreamQueriesRequest& message_;
  grpc::CompletionQueue queue_;
  std::vector<std::unique_ptr<Guest>> guests_;
};

// Clients that connect, send one query, and leave. Once `at_once` guests are connected, each new guest replaces the
// oldest. Every second guest finishes its call, the others cancel it. At the end of run() all have left.
class Churn {
 public:
  // Borrows the message.
  Churn(const std::string& address, size_t at_once, const v1::StreamQueriesRequest& message);
  ~Churn();
  Churn(const Churn&) = delete;
  Churn& operator=(const Churn&) = delete;

  // Runs until `guests` guests have connected and left. Errors are stored in status().
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
  std::deque<std::unique_ptr<Guest>> guests_;  // oldest first
  size_t came_ = 0, coming_ = 0, staying_ = 0;
  absl::Status status_;
};

}  // namespace locus::bench::serving

#endif  // LOCUS_TESTS_BENCH_SERVING_GUESTS_H_
