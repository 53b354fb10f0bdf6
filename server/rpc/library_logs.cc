#include "server/rpc/library_logs.h"

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>

#include <atomic>
#include <string>

#include "server/observability/log.h"

namespace locus::server {
namespace {

std::atomic<LogLevel> grpc_errors{LogLevel::kWarning};

void log_for_grpc(gpr_log_func_args* args) {
  const LogLevel level = args->severity == GPR_LOG_SEVERITY_ERROR ? grpc_errors.load() : LogLevel::kDebug;
  log(level, "grpc", {{"text", args->message}});
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
