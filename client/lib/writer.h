// Writer ids and batch numbers of streams that update a scene. Internal to the library.
#ifndef LOCUS_CLIENT_LIB_WRITER_H_
#define LOCUS_CLIENT_LIB_WRITER_H_

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <random>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "client/lib/status.h"
#include "locus/v1/errors.pb.h"
#include "locus/v1/update_service.pb.h"

namespace locus::client {

// Returns a random writer id, which is not 0.
inline uint64_t random_writer() {
  std::random_device device;
  uint64_t writer = 0;
  while (writer == 0) writer = (uint64_t{device()} << 32) | device();
  return writer;
}

// Returns whether the server answered a batch with an error that shows that this message changed nothing. After an
// error without a reason this is unknown, except that a caller without the right to update never changes anything.
// REASON_BATCH_GAP is not such an error: it is about the numbers before the batch.
inline bool changed_nothing(const absl::Status& failure) {
  const std::optional<v1::Error> error = error_of(failure);
  if (!error || error->reason() == v1::REASON_BATCH_GAP) return false;
  return error->reason() != v1::REASON_UNSPECIFIED || absl::IsPermissionDenied(failure);
}

// Returns the error for an update that the server refused when it was sent again, although an earlier message of the
// same update may have been applied. It keeps the code, but has no reason, because refused_by_server() is not true.
inline absl::Status outcome_unknown(const absl::Status& refusal) {
  return absl::Status(refusal.code(),
                      absl::StrCat("the update may have been applied: it was sent before the connection broke, and was "
                                   "refused when it was sent again: ",
                                   refusal.message()));
}

// Returns the value of UpdateBatch.lease_ms for a lease; a positive duration is at least 1 ms.
inline uint32_t lease_ms_of(absl::Duration lease) {
  if (lease <= absl::ZeroDuration()) return 0;
  const int64_t rounded_up = absl::ToInt64Milliseconds(absl::Ceil(lease, absl::Milliseconds(1)));
  return static_cast<uint32_t>(std::min<int64_t>(rounded_up, std::numeric_limits<uint32_t>::max()));
}

// Returns the maximum time that a stream with a lease lets pass without a batch: a third of the lease, so that a
// renewal may be late or lost.
inline absl::Duration renewal_of(absl::Duration lease) {
  return lease > absl::ZeroDuration() ? lease / 3 : absl::InfiniteDuration();
}

// Batch numbers of the writer of a stream. Not thread-safe.
//
// The server applies batches densely from number 1 and answers REASON_BATCH_GAP with the number that it expects. The
// number of a refused batch is used again, except if an earlier call had sent the batch: then the batch may have been
// applied, because the server may refuse a message before it compares its number. Such a number is uncertain, and the
// later batches keep their numbers. If the server accepts one of them, the uncertain number was used. If it answers
// with the gap that an uncertain number leaves, the numbers from the expected one on are used again.
class BatchNumbers {
 public:
  enum class AfterFailure { kEndStream, kKeepNumbers, kNumberLaterAgain };

  // `lease_ms` is the lease of the writer, which every batch carries; 0 = none.
  BatchNumbers(uint64_t writer, uint64_t next, uint32_t lease_ms)
      : writer_(writer != 0 ? writer : random_writer()), lease_ms_(lease_ms), next_(next) {}

  uint64_t writer() const { return writer_; }
  void number(v1::UpdateBatch& batch) {
    batch.set_writer(writer_);
    batch.set_batch(next_++);
    if (lease_ms_ != 0 && batch.lease_ms() == 0) batch.set_lease_ms(lease_ms_);
  }

  // Handles the ack of batch `number`. `sent_before`: an earlier call sent the batch with this number. Returns an error
  // if a number that seemed unused was taken by another batch after all, so that this batch was not applied.
  absl::Status acked(uint64_t number, bool duplicate, bool sent_before) {
    if (duplicate && !sent_before && number < reused_end_)
      return absl::DataLossError("the batch was not applied: a batch that was sent before took its number");
    if (number > uncertain_) uncertain_ = 0;
    return absl::OkStatus();
  }

  // Handles the error of batch `number`. After kNumberLaterAgain, the caller numbers the later batches again.
  AfterFailure failed(uint64_t number, bool sent_before, const absl::Status& failure) {
    if (!changed_nothing(failure)) return AfterFailure::kEndStream;
    if (sent_before) {
      uncertain_ = uncertain_ == 0 ? number : std::min(uncertain_, number);
      return AfterFailure::kKeepNumbers;
    }
    next_ = number;
    return AfterFailure::kNumberLaterAgain;
  }

  // Returns true if `failure` of batch `number` shows that uncertain numbers before it were not used. The caller then
  // numbers this batch and the later ones again and sends them.
  bool closes_gap(uint64_t number, const absl::Status& failure) {
    const std::optional<v1::Error> error = error_of(failure);
    if (uncertain_ == 0 || !error || error->reason() != v1::REASON_BATCH_GAP) return false;
    const double expected = error->limit_value();
    if (expected < static_cast<double>(uncertain_) || expected >= static_cast<double>(number)) return false;
    reused_end_ = number;
    next_ = static_cast<uint64_t>(expected);
    uncertain_ = 0;
    return true;
  }

 private:
  const uint64_t writer_;
  const uint32_t lease_ms_;
  uint64_t next_;
  uint64_t uncertain_ = 0;   // lowest uncertain number; 0 = none
  uint64_t reused_end_ = 0;  // end of the uncertain numbers that closes_gap() has used again
};

// Handles the error `outcome` of batch `number` for a stream. Calls number_later_again() if the later batches must be
// numbered again. If the batch may have been applied, `outcome` becomes an error that says so. Returns an error if the
// stream must end.
template <class Outcome, class NumberLaterAgain>
absl::Status handle_refusal(BatchNumbers& numbers, uint64_t number, bool sent_before, Outcome& outcome,
                            const NumberLaterAgain& number_later_again) {
  switch (numbers.failed(number, sent_before, outcome.status())) {
    case BatchNumbers::AfterFailure::kEndStream:
      return outcome.status();
    case BatchNumbers::AfterFailure::kKeepNumbers:
      outcome = outcome_unknown(outcome.status());
      break;
    case BatchNumbers::AfterFailure::kNumberLaterAgain:
      number_later_again();
      break;
  }
  return absl::OkStatus();
}

}  // namespace locus::client

#endif  // LOCUS_CLIENT_LIB_WRITER_H_
