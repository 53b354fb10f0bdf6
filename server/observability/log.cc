#include "server/observability/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"

namespace locus::server {
namespace {

// Maximum size in bytes of a field's value. Longer values are cut, because callers choose some of the values.
constexpr size_t kMaxValue = 1024;

std::atomic<LogFormat> log_format{LogFormat::kText};

thread_local const TraceContext* current_trace = nullptr;

spdlog::level::level_enum to_spdlog(LogLevel level) {
  switch (level) {
    case LogLevel::kDebug:
      return spdlog::level::debug;
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarning:
      return spdlog::level::warn;
    case LogLevel::kError:
      return spdlog::level::err;
  }
  return spdlog::level::err;
}

spdlog::logger& logger() {
  static const std::shared_ptr<spdlog::logger> kInstance = [] {
    auto made = std::make_shared<spdlog::logger>("locusd", std::make_shared<spdlog::sinks::stderr_sink_mt>());
    made->set_level(spdlog::level::warn);
    return made;
  }();
  return *kInstance;
}

// Appends `text` to `out` with JSON escapes. The text format uses these escapes too, because an unescaped line break or
// quote would break a line of text.
void append_escaped(std::string& out, absl::string_view text) {
  constexpr absl::string_view kHex = "0123456789abcdef";
  for (const char c : text.substr(0, kMaxValue)) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      absl::StrAppend(&out, "\\", absl::string_view(&c, 1));
    } else if (byte < 0x20 || byte == 0x7f) {
      absl::StrAppend(&out, "\\u00", kHex.substr(byte >> 4, 1), kHex.substr(byte & 15, 1));
    } else {
      out.push_back(c);
    }
  }
}

std::string json_line(absl::string_view message, const std::vector<LogField>& fields) {
  std::string line = R"("message":")";
  append_escaped(line, message);
  line += '"';
  for (const LogField& field : fields) {
    absl::StrAppend(&line, ",\"", field.name, "\":\"");
    append_escaped(line, field.value);
    line += '"';
  }
  return line;
}

std::string text_line(absl::string_view message, const std::vector<LogField>& fields) {
  std::string line;
  append_escaped(line, message);
  for (const LogField& field : fields) {
    const bool quoted = field.value.empty() || field.value.find(' ') != std::string::npos;
    absl::StrAppend(&line, " ", field.name, quoted ? "=\"" : "=");
    append_escaped(line, field.value);
    if (quoted) line += '"';
  }
  return line;
}

}  // namespace

void start_logging(LogLevel level, LogFormat format) {
  log_format = format;
  logger().set_level(to_spdlog(level));
  logger().set_pattern(format == LogFormat::kJson ? R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l",%v})"
                                                  : "%Y-%m-%dT%H:%M:%S.%eZ %l %v",
                       spdlog::pattern_time_type::utc);
}

bool logs(LogLevel level) { return logger().should_log(to_spdlog(level)); }

void log(LogLevel level, absl::string_view message, std::initializer_list<LogField> fields) {
  if (!logs(level)) return;
  std::vector<LogField> all = fields;
  if (current_trace != nullptr) {
    all.push_back({"request_id", current_trace->request_id});
    if (!current_trace->traceparent.empty()) all.push_back({"traceparent", current_trace->traceparent});
  }
  const std::string line = log_format == LogFormat::kJson ? json_line(message, all) : text_line(message, all);
  logger().log(to_spdlog(level), spdlog::string_view_t(line.data(), line.size()));
}

LogScope::LogScope(TraceContext trace) : trace_(std::move(trace)), outer_(current_trace) { current_trace = &trace_; }

LogScope::~LogScope() {
  LOCUS_DCHECK(current_trace == &trace_);  // scopes of a thread end in reverse order
  current_trace = outer_;
}

TraceContext LogScope::current() { return current_trace == nullptr ? TraceContext() : *current_trace; }

}  // namespace locus::server
