#include "server/rpc/library_logs.h"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "server/config/observability_limits.h"
#include "server/observability/line_limit.h"
#include "server/observability/log.h"

namespace locus::server {
namespace {

std::atomic<LogLevel> grpc_errors{LogLevel::kWarning};

// Logs a message of gRPC. Limits the number of lines, because any peer can cause errors of gRPC, such as a failed TLS
// handshake, as often as it connects.
void log_for_grpc(gpr_log_func_args* args) {
  static LineLimit& lines = *new LineLimit(kMaxLibraryLines);
  const LogLevel level = args->severity == GPR_LOG_SEVERITY_ERROR ? grpc_errors.load() : LogLevel::kDebug;
  if (level == LogLevel::kDebug) return log(level, "grpc", {{"text", args->message}});
  const std::optional<uint64_t> left_out = lines.admit(std::chrono::steady_clock::now());
  if (left_out) log(level, "grpc", {{"text", args->message}, {"left_out", absl::StrCat(*left_out)}});
}

void log_for_protobuf(google::protobuf::LogLevel, const char*, int, const std::string& text) {
  log(LogLevel::kDebug, "protobuf", {{"text", text}});
}

}  // namespace

void capture_library_logs(LogLevel errors) {
  grpc_errors = errors;
  gpr_set_log_function(&log_for_grpc);
  google::protobuf::SetLogHandler(&log_for_protobuf);
}

}  // namespace locus::server
