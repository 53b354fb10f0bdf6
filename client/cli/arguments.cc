#include "client/cli/arguments.h"

#include <array>
#include <cmath>
#include <limits>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "core/base/check.h"

namespace locus::cli {
namespace {

template <size_t N>
bool parse_list(absl::string_view text, std::array<double, N>& values) {
  const std::vector<absl::string_view> parts = absl::StrSplit(text, ',');
  if (parts.size() != N || absl::StrContains(text, ' ')) return false;  // SimpleAtod() would skip blanks
  for (size_t i = 0; i < N; ++i)
    if (!absl::SimpleAtod(parts[i], &values[i])) return false;
  return true;
}

template <size_t N>
bool read_list(std::istream& in, std::array<double, N>& values) {
  std::string text;
  in >> text;
  const bool good = parse_list(text, values);
  if (!good) in.setstate(std::ios::failbit);
  return good;
}

// Returns a validator that refuses values that are not N numbers. `form` and `example` are for its message.
template <size_t N>
CLI::Validator list_validator(const std::string& form, const std::string& example) {
  return CLI::Validator(
      [form, example](const std::string& text) -> std::string {
        std::array<double, N> values{};
        if (parse_list(text, values)) return "";
        return absl::StrCat("'", text, "' is not ", form, " numbers with commas and without blanks, such as ", example);
      },
      "");
}

bool parse_number(absl::string_view text, uint64_t& value) {
  if (absl::ConsumePrefix(&text, "0x")) return absl::SimpleHexAtoi(text, &value);
  return absl::SimpleAtoi(text, &value);
}

}  // namespace

std::istream& operator>>(std::istream& in, Triple& triple) {
  std::array<double, 3> values{};
  if (read_list(in, values)) triple = {values[0], values[1], values[2]};
  return in;
}

std::istream& operator>>(std::istream& in, Quaternion& quaternion) {
  std::array<double, 4> values{};
  if (read_list(in, values)) {
    quaternion = {static_cast<float>(values[0]), static_cast<float>(values[1]), static_cast<float>(values[2]),
                  static_cast<float>(values[3])};
  }
  return in;
}

std::istream& operator>>(std::istream& in, Number64& number) {
  std::string text;
  in >> text;
  if (!parse_number(text, number.value)) in.setstate(std::ios::failbit);
  return in;
}

std::ostream& operator<<(std::ostream& out, const Triple& triple) {
  return out << triple.x << ',' << triple.y << ',' << triple.z;
}

std::ostream& operator<<(std::ostream& out, const Quaternion& quaternion) {
  return out << quaternion.x << ',' << quaternion.y << ',' << quaternion.z << ',' << quaternion.w;
}

std::ostream& operator<<(std::ostream& out, const Number64& number) { return out << number.value; }

std::vector<uint64_t> values_of(const std::vector<Number64>& numbers) {
  std::vector<uint64_t> values;
  values.reserve(numbers.size());
  for (const Number64& number : numbers) values.push_back(number.value);
  return values;
}

std::vector<uint32_t> values32_of(const std::vector<Number64>& numbers) {
  std::vector<uint32_t> values;
  values.reserve(numbers.size());
  for (const Number64& number : numbers) {
    LOCUS_DCHECK_LE(number.value, uint64_t{std::numeric_limits<uint32_t>::max()});
    values.push_back(static_cast<uint32_t>(number.value));
  }
  return values;
}

std::vector<float> floats_of(const std::vector<double>& numbers) {
  std::vector<float> floats;
  floats.reserve(numbers.size());
  for (const double number : numbers) floats.push_back(static_cast<float>(number));
  return floats;
}

std::vector<float> floats_of(const std::vector<Triple>& triples) { return floats_of(doubles_of(triples)); }

std::vector<double> doubles_of(const std::vector<Triple>& triples) {
  std::vector<double> doubles;
  for (const Triple& triple : triples) doubles.insert(doubles.end(), {triple.x, triple.y, triple.z});
  return doubles;
}

std::vector<float> floats_of(const std::vector<Quaternion>& quaternions) {
  std::vector<float> floats;
  for (const Quaternion& q : quaternions) floats.insert(floats.end(), {q.x, q.y, q.z, q.w});
  return floats;
}

CLI::Validator positive_number() {
  return CLI::Validator(
      [](const std::string& text) -> std::string {
        double number = 0;
        const bool good = absl::SimpleAtod(text, &number) && number > 0 && std::isfinite(number);
        return good ? "" : absl::StrCat("'", text, "' is not a number above 0");
      },
      "");
}

CLI::Validator three_numbers() { return list_validator<3>("X,Y,Z: three", "0,0,100"); }

CLI::Validator four_numbers() { return list_validator<4>("X,Y,Z,W: four", "0,0,0,1"); }

CLI::Validator fits_32_bits() {
  return CLI::Validator(
      [](const std::string& text) -> std::string {
        uint64_t value = 0;
        const bool fits = parse_number(text, value) && value <= std::numeric_limits<uint32_t>::max();
        return fits ? "" : absl::StrCat(text, " is not a number from 0 to 4294967295");
      },
      "");
}

}  // namespace locus::cli
