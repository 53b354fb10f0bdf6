// Types for option values in the form in which users type them: triples, quaternions, ids. The option parser (CLI11)
// reads a value with operator>>, which sets failbit unless the whole text has the expected form. Plain data.
#ifndef LOCUS_CLIENT_CLI_ARGUMENTS_H_
#define LOCUS_CLIENT_CLI_ARGUMENTS_H_

#include <cstdint>
#include <istream>
#include <ostream>
#include <string>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// Vector written as "1,2.5,-3".
struct Triple {
  double x = 0, y = 0, z = 0;
};

// Rotation written as "0,0,0,1": x, y, z, w.
struct Quaternion {
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

// Adds an option that may be given several times, with one value each time, so that a command line can contain several
// items of a batch.
template <class T>
CLI::Option* add_repeatable(CLI::App& command, const std::string& name, std::vector<T>& values, const std::string& type,
                            const std::string& description) {
  return command.add_option(name, values, description)->type_name(type)->allow_extra_args(false);
}

// Returns a validator that refuses numbers that do not fit in 32 bits.
CLI::Validator fits_32_bits();

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ARGUMENTS_H_
