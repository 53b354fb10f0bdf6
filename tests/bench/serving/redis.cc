#include "tests/bench/serving/redis.h"

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace locus::bench::serving {
namespace {

constexpr double kStartSeconds = 10;
constexpr double kPatience = 0.005;

// Returns the path of a program that runs as a Redis server if its argv[0] is redis-server; empty if none is installed.
// This can be redis-check-rdb in Debian's redis-tools, so the package redis-server, which would start a service, is not
// needed.
std::string redis_program() {
  const std::string server = program_in_path("redis-server");
  return server.empty() ? program_in_path("redis-check-rdb") : server;
}

// Reads the number after the first character of the line at `at`, and advances `at` to the next line; returns false if
// the line is incomplete.
bool read_line(absl::string_view text, size_t& at, int64_t& number) {
  const size_t end = text.find("\r\n", at);
  if (end == absl::string_view::npos) return false;
  if (!absl::SimpleAtoi(text.substr(at + 1, end - at - 1), &number)) number = 0;
  at = end + 2;
  return true;
}

// Advances `at` past one element that is not a list; returns false if the element is incomplete.
bool pass_element(absl::string_view text, size_t& at) {
  if (at >= text.size()) return false;
  const bool is_string = text[at] == '$';
  int64_t bytes = 0;
  if (!read_line(text, at, bytes)) return false;
  if (is_string && bytes >= 0) at += static_cast<size_t>(bytes) + 2;
  return at <= text.size();
}

}  // namespace

std::string redis_command(const std::vector<std::string>& words) {
  std::string command = absl::StrCat("*", words.size(), "\r\n");
  for (const std::string& word : words) absl::StrAppend(&command, "$", word.size(), "\r\n", word, "\r\n");
  return command;
}

size_t redis_reply_bytes(absl::string_view received) {
  size_t at = 0;
  if (received.empty() || received.front() != '*') return pass_element(received, at) ? at : 0;
  int64_t elements = 0;
  if (!read_line(received, at, elements)) return 0;
  for (int64_t i = 0; i < elements; ++i)
    if (!pass_element(received, at)) return 0;
  return at;
}

absl::StatusOr<std::unique_ptr<Redis>> Redis::start() {
  const std::string program = redis_program();
  if (program.empty()) return absl::UnavailableError("redis-tools is not installed; run deploy/packages.sh bench");
  auto redis = std::unique_ptr<Redis>(new Redis());
  const std::string path = redis->folder_.file("socket");
  const std::vector<std::string> words = {
      "redis-server", "--port", "0",     "--unixsocket",          path,          "--save", "",
      "--appendonly", "no",     "--dir", redis->folder_.file(""), "--daemonize", "no"};
  auto process = Process::start(program, words, redis->folder_.file("log"));
  if (!process.ok()) return process.status();
  redis->process_ = *std::move(process);
  int socket = -1;
  for (double waited = 0; socket < 0 && waited < kStartSeconds && !redis->process_->has_ended(); waited += kPatience) {
    sleep_seconds(kPatience);
    socket = connect_to_path(path);
  }
  if (socket < 0) return absl::UnavailableError("redis-server was started but does not answer");
  redis->connection_ = std::make_unique<SocketLoad>(socket, redis_reply_bytes);
  return redis;
}

void Redis::run(const std::vector<std::string>& messages, size_t passes, size_t window) {
  counted_ = 0;
  size_t sent = 0;
  const auto next = [&]() -> absl::string_view {
    const size_t at = sent++;
    return at < passes * messages.size() ? absl::string_view(messages[at % messages.size()]) : absl::string_view();
  };
  const auto reply = [&](absl::string_view text) {
    if (text.front() == '-') status_.Update(absl::InternalError(absl::StrCat("redis: ", text)));
    int64_t number = 0;
    size_t at = 0;
    if ((text.front() == '*' || text.front() == ':') && read_line(text, at, number))
      counted_ += static_cast<size_t>(number);
  };
  status_.Update(connection_->run(window, next, reply));
}

}  // namespace locus::bench::serving
