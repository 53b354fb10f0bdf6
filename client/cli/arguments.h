// Types for option values in the form in which users type them: triples, quaternions, ids. The option parser (CLI11)
// reads a value with operator>>, which sets failbit unless the whole text has the expected form. A type of
// several numbers must not be constructible from one number, because CLI11 would then read one number and construct the
// value from it. Plain data.
#ifndef LOCUS_CLIENT_CLI_ARGUMENTS_H_
#define LOCUS_CLIENT_CLI_ARGUMENTS_H_

#include <cstdint>
#include <istream>
#include <ostream>
#include <string>
#include <type_traits>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// Vector written as "1,2.5,-3".
struct Triple {
  Triple() = default;
  Triple(double new_x, double new_y, double new_z) : x(new_x), y(new_y), z(new_z) {}

  double x = 0, y = 0, z = 0;
};

// Rotation written as "0,0,0,1": x, y, z, w.
struct Quaternion {
  Quaternion() = default;
  Quaternion(float new_x, float new_y, float new_z, float new_w) : x(new_x), y(new_y), z(new_z), w(new_w) {}

  float x = 0, y = 0, z = 0, w = 1;
};

// Id, group, tag or mask: 0 to 2^64 - 1, in decimal or, with 0x, in hexadecimal.
struct Number64 {
  uint64_t value = 0;
};

std::istream& operator>>(std::istream& in, Triple& triple);
std::istream& operator>>(std::istream& in, Quaternion& quaternion);
std::istream& operator>>(std::istream& in, Number64& number);
// Write a value in the form that operator>> reads, so that the help text can show an option's default.
std::ostream& operator<<(std::ostream& out, const Triple& triple);
std::ostream& operator<<(std::ostream& out, const Quaternion& quaternion);
std::ostream& operator<<(std::ostream& out, const Number64& number);

std::vector<uint64_t> values_of(const std::vector<Number64>& numbers);
// Convert the values of an option to a column. Precondition of values32_of(): every number fits in 32 bits. The
// validator fits_32_bits() checks this when the command line is parsed.
std::vector<uint32_t> values32_of(const std::vector<Number64>& numbers);
std::vector<float> floats_of(const std::vector<double>& numbers);
std::vector<float> floats_of(const std::vector<Triple>& triples);
std::vector<double> doubles_of(const std::vector<Triple>& triples);
std::vector<float> floats_of(const std::vector<Quaternion>& quaternions);

// Returns a validator that refuses values that are not a finite number above 0.
CLI::Validator positive_number();

// Return validators that refuse values that are not three numbers "X,Y,Z", or four numbers "X,Y,Z,W".
CLI::Validator three_numbers();
CLI::Validator four_numbers();

// Adds an option that may be given several times, with one value each time, so that a command line can contain several
// items of a batch.
template <class T>
CLI::Option* add_repeatable(CLI::App& command, const std::string& name, std::vector<T>& values, const std::string& type,
                            const std::string& description) {
  CLI::Option* const option = command.add_option(name, values, description)->type_name(type)->allow_extra_args(false);
  if constexpr (std::is_same_v<T, Triple>) option->check(three_numbers());
  if constexpr (std::is_same_v<T, Quaternion>) option->check(four_numbers());
  return option;
}

// Adds an option whose value is three numbers. `value` is a Triple or std::optional<Triple>.
template <class T>
CLI::Option* add_triple(CLI::App& command, const std::string& name, T& value, const std::string& description) {
  return command.add_option(name, value, description)->type_name("X,Y,Z")->check(three_numbers());
}

// Returns a validator that refuses numbers that do not fit in 32 bits.
CLI::Validator fits_32_bits();

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ARGUMENTS_H_
