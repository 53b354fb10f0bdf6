// The daemon's log on standard error: one line for each event, as text or JSON. Only log.cc includes the logging
// library.
//
// Threads: call start_logging() once, before other threads log. Any thread may call every other function. Lines are
// written atomically.
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

// Sets the level and the format. Before this call, events of level `warning` and above are written as text.
void start_logging(LogLevel level, LogFormat format);

// Returns whether events of this level are written.
bool logs(LogLevel level);

// Writes an event. `message` names the kind of event and is a constant text; `fields` contain the details. Control
// characters, which may come from callers, are escaped, and values longer than 1,024 bytes are cut.
void log(LogLevel level, absl::string_view message, std::initializer_list<LogField> fields = {});

// Scope that names the call on which this thread works: during the scope's lifetime, every line that the thread logs
// has the field request_id and, if the caller sent a traceparent, the field traceparent. Scopes may be nested; the ids
// of the innermost scope are logged.
class LogScope {
 public:
  explicit LogScope(TraceContext trace);
  ~LogScope();
  LogScope(const LogScope&) = delete;
  LogScope& operator=(const LogScope&) = delete;

  // Returns the ids of this thread's innermost scope, for passing them to another thread. The ids are empty if the
  // thread has no scope.
  static TraceContext current();

 private:
  const TraceContext trace_;
  const TraceContext* const outer_;
};

}  // namespace locus::server

#endif  // LOCUS_SERVER_OBSERVABILITY_LOG_H_
