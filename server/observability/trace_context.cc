#include "server/observability/trace_context.h"

#include <algorithm>
#include <atomic>
#include <random>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/config/observability_limits.h"

namespace locus::server {
namespace {

constexpr size_t kTraceparentLength = 55;  // length of a traceparent of version 00
constexpr size_t kMaxTraceparentLength = 128;

bool is_hex(absl::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return absl::ascii_isdigit(c) || (c >= 'a' && c <= 'f'); });
}

bool is_zero(absl::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c == '0'; });
}

uint64_t random_seed() {
  std::random_device device;
  return uint64_t{device()} << 32 | device();
}

}  // namespace

bool is_request_id(absl::string_view text) {
  if (text.empty() || text.size() > kMaxRequestIdLength) return false;
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return absl::ascii_isalnum(c) || c == '.' || c == '_' || c == '-'; });
}

bool is_traceparent(absl::string_view text) {
  if (text.size() < kTraceparentLength || text.size() > kMaxTraceparentLength) return false;
  const absl::string_view version = text.substr(0, 2);
  const absl::string_view trace = text.substr(3, 32);
  const absl::string_view parent = text.substr(36, 16);
  if (text[2] != '-' || text[35] != '-' || text[52] != '-') return false;
  if (!is_hex(version) || !is_hex(trace) || !is_hex(parent) || !is_hex(text.substr(53, 2))) return false;
  if (version == "ff" || is_zero(trace) || is_zero(parent)) return false;
  if (text.size() == kTraceparentLength) return true;
  const absl::string_view rest = text.substr(kTraceparentLength);
  return version != "00" && rest.front() == '-' &&
         std::all_of(rest.begin(), rest.end(), [](char c) { return absl::ascii_isgraph(c); });
}

uint64_t next_request_number() {
  static std::atomic<uint64_t> next{0};
  return next.fetch_add(1, std::memory_order_relaxed);
}

std::string request_id_of(uint64_t number) {
  static const uint64_t kSeed = random_seed();
  // Mixes the number by a bijection, so that different numbers have different ids. Source: Steele et al., "Fast
  // splittable pseudorandom number generators" (2014).
  uint64_t z = kSeed + number * 0x9e3779b97f4a7c15;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9;
  z = (z ^ z >> 27) * 0x94d049bb133111eb;
  return absl::StrCat(absl::Hex(z ^ z >> 31, absl::kZeroPad16));
}

}  // namespace locus::server
