// The program `locus-echo`: it serves streams of queries. Its template for calls, number of IO threads and limits are
// those of locusd. It has no scene and checks only the lengths of the request's columns. It answers every batch
// immediately with columns of 24 bytes per ray, so that locus-bench can measure transport alone. locus-bench starts it
// with locusd's options for the port.
#include <fcntl.h>
#include <grpcpp/resource_quota.h>
#include <grpcpp/server.h>
#include <grpcpp/server_builder.h>
#include <malloc.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <list>

#include "absl/strings/str_cat.h"
#include "locus/v1/query_service.grpc.pb.h"
#include "server/config/server_config.h"
#include "server/rpc/hot_call.h"
#include "tests/bench/serving/echo_answer.h"

namespace locus::bench::serving {
namespace {

using Service = v1::QueryService::WithRawMethod_StreamQueries<v1::QueryService::Service>;

class EchoWork {
 public:
  explicit EchoWork(server::CallSlot& slot) : slot_(slot) {}
  void begin(const v1::QueryBatch& batch, v1::QueryResult& result) {
    if (batch.blocks_size() != 1 || batch.blocks(0).rays().origins_size() != 3 * batch.blocks(0).masks_size())
      return slot_.answered(absl::InvalidArgumentError("one block of rays, each with a mask"));
    answer_echo(batch, result);
    slot_.answered(absl::OkStatus());
  }
  void give_up() {}

 private:
  server::CallSlot& slot_;
};

struct EchoMethod {
  using Request = v1::StreamQueriesRequest;
  using Response = v1::StreamQueriesResponse;
  using Work = EchoWork;
  static constexpr server::Rpc kRpc = server::Rpc::kStreamQueries;
  static constexpr const char* kPath = "/locus.v1.QueryService/StreamQueries";
  static constexpr bool kStream = true;
  static constexpr bool kInOrder = false;

  void listen(grpc::ServerContext* context, grpc::ServerAsyncReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer>* wire,
              grpc::ServerCompletionQueue* queue, void* tag) const {
    service->RequestStreamQueries(context, wire, queue, queue, tag);
  }
  Work make_work(server::CallSlot& slot) const { return Work(slot); }
  static bool is_change(const Request&, const Response&) { return false; }
  void begin(Work& work, const std::string&, const Request& request, Response& response) const {
    work.begin(request.batch(), *response.mutable_result());
  }

  Service* service;
};

// Tunes malloc like locusd. Called first in main(), before anything is allocated.
void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, 64 << 20);
  mallopt(M_TRIM_THRESHOLD, 512 << 20);
  mallopt(M_TOP_PAD, 16 << 20);
}

void set_limits(const server::ServerConfig& config, grpc::ServerBuilder& builder) {
  grpc::ResourceQuota quota("locus-echo");
  builder.SetResourceQuota(quota);
  builder.SetMaxReceiveMessageSize(static_cast<int>(config.max_receive_bytes));
  builder.SetMaxSendMessageSize(-1);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, static_cast<int>(config.max_streams));
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
}

// Writes the port to the file atomically, since locus-bench polls the file. Returns false on failure.
bool write_port(const std::string& path, int port) {
  const std::string temporary = path + ".tmp", text = absl::StrCat(port, "\n");
  const int file = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  const bool written = file >= 0 && write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (file >= 0) close(file);
  return written && std::rename(temporary.c_str(), path.c_str()) == 0;
}

// Serves until a signal ends the process.
int serve(const server::ServerConfig& config) {
  server::RpcState state(config.max_calls, config.max_streams, config.memory_limit, [] { return 0; });
  Service service;
  grpc::ServerBuilder builder;
  set_limits(config, builder);
  int port = 0;
  builder.AddListeningPort(config.listen.front(), grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&service);
  server::IoThreads io(builder, server::IoThreads::count_for(config.threads));
  const std::unique_ptr<grpc::Server> grpc = builder.BuildAndStart();
  if (grpc == nullptr) return EXIT_FAILURE;
  std::list<server::Listener<EchoMethod>> listeners;
  for (size_t i = 0; i < io.loops(); ++i) listeners.emplace_back(state, EchoMethod{&service}, io.loop(i)).listen();
  io.start();
  if (!write_port(config.port_file, port)) std::_Exit(EXIT_FAILURE);
  while (true) pause();
}

}  // namespace
}  // namespace locus::bench::serving

int main(int argc, char** argv) {
  locus::bench::serving::keep_freed_memory();
  const locus::server::Invocation invocation =
      locus::server::read_invocation({argv + 1, argv + argc}, locus::server::process_environment);
  if (invocation.config) return locus::bench::serving::serve(*invocation.config);
  std::fputs(invocation.text.c_str(), stderr);
  return invocation.exit_code;
}
