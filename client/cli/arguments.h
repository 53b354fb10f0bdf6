// Values as people type them: triples, quaternions, ids. For the option parser, which reads any type through
// operator>>. Plain data; reading fails (sets failbit) on anything but the whole text being of the form.
#ifndef LOCUS_CLIENT_CLI_ARGUMENTS_H_
#define LOCUS_CLIENT_CLI_ARGUMENTS_H_

#include <cstdint>
#include <istream>
#include <ostream>
#include <string>
#include <vector>

#include "CLI/CLI.hpp"

namespace locus::cli {

// "1,2.5,-3".
struct Triple {
  double x = 0, y = 0, z = 0;
};

// "0,0,0,1": x, y, z, w.
struct Quaternion {
  float x = 0, y = 0, z = 0, w = 1;
};

// 0 to 2^64 - 1, in decimal or with 0x in hexadecimal: ids, groups, tags, masks.
struct Number64 {
  uint64_t value = 0;
};

std::istream& operator>>(std::istream& in, Triple& triple);
std::istream& operator>>(std::istream& in, Quaternion& quaternion);
std::istream& operator>>(std::istream& in, Number64& number);
// How the parser shows a default.
std::ostream& operator<<(std::ostream& out, const Triple& triple);
std::ostream& operator<<(std::ostream& out, const Quaternion& quaternion);
std::ostream& operator<<(std::ostream& out, const Number64& number);

std::vector<uint64_t> values_of(const std::vector<Number64>& numbers);
// Cuts to 32 bits what the parser has checked to fit.
std::vector<uint32_t> values32_of(const std::vector<Number64>& numbers);
std::vector<float> floats_of(const std::vector<double>& numbers);
std::vector<float> floats_of(const std::vector<Triple>& triples);
std::vector<double> doubles_of(const std::vector<Triple>& triples);
std::vector<float> floats_of(const std::vector<Quaternion>& quaternions);

// An option that may be given several times, one value each time, so that a batch is written by repeating it.
template <class T>
CLI::Option* add_repeatable(CLI::App& command, const std::string& name, std::vector<T>& values, const std::string& type,
                            const std::string& description) {
  return command.add_option(name, values, description)->type_name(type)->allow_extra_args(false);
}

// Refuses what does not fit 32 bits.
CLI::Validator fits_32_bits();

}  // namespace locus::cli

#endif  // LOCUS_CLIENT_CLI_ARGUMENTS_H_
