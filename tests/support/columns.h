// Memory for the columns that batches borrow, so that a test can write a batch as literals. A span is valid as long as
// the Columns object that returned it.
#ifndef LOCUS_TESTS_SUPPORT_COLUMNS_H_
#define LOCUS_TESTS_SUPPORT_COLUMNS_H_

#include <cstdint>
#include <deque>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/types/span.h"

namespace locus::test {

class Columns {
 public:
  template <class T>
  absl::Span<const T> keep(std::vector<T> values) {
    return std::get<std::deque<std::vector<T>>>(kept_).emplace_back(std::move(values));
  }
  absl::Span<const float> floats(std::vector<float> values) { return keep(std::move(values)); }
  absl::Span<const double> doubles(std::vector<double> values) { return keep(std::move(values)); }
  absl::Span<const uint64_t> ids(std::vector<uint64_t> values) { return keep(std::move(values)); }
  absl::Span<const uint32_t> words(std::vector<uint32_t> values) { return keep(std::move(values)); }

 private:
  std::tuple<std::deque<std::vector<float>>, std::deque<std::vector<double>>, std::deque<std::vector<uint64_t>>,
             std::deque<std::vector<uint32_t>>>
      kept_;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_COLUMNS_H_
