// What the daemon says on standard error: one line an event, for people or as JSON. The only place that knows the
// logging library.
//
// Threads: start_logging() once, before anything is logged; the rest from any thread. A line is written whole.
#ifndef LOCUS_SERVER_OBSERVABILITY_LOG_H_
#define LOCUS_SERVER_OBSERVABILITY_LOG_H_

#include <initializer_list>
#include <string>

#include "absl/strings/string_view.h"
#include "server/config/server_config.h"
#include "server/observability/trace_context.h"

namespace locus::server {

// A named value of an event. Values are printed as text.
struct LogField {
  absl::string_view name;
  std::string value;
};

// Without it everything from `warning` on is written as text.
void start_logging(LogLevel level, LogFormat format);

bool logs(LogLevel level);

// `message` says what happened and is the same for every event of a kind; `fields` say to what. Control characters,
// which may come from callers, are escaped.
void log(LogLevel level, absl::string_view message, std::initializer_list<LogField> fields = {});

// Names the call that this thread works on: while it lives, every line the thread logs has the fields request_id and,
// where there is one, traceparent. Scopes may be nested; the innermost counts.
class LogScope {
 public:
  explicit LogScope(TraceContext trace);
  ~LogScope();
  LogScope(const LogScope&) = delete;
  LogScope& operator=(const LogScope&) = delete;

  // Of the innermost scope of this thread; empty without one. For work that another thread goes on with.
  static TraceContext current();

 private:
  const TraceContext trace_;
  const TraceContext* const outer_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_LOG_H_
