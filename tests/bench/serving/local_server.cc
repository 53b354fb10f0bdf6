#include "tests/bench/serving/local_server.h"

#include "absl/strings/str_cat.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/support/channel_arguments.h"

namespace locus::bench::serving {
namespace {

constexpr double kStartSeconds = 20;
constexpr double kPatience = 0.005;

}  // namespace

std::shared_ptr<grpc::Channel> connection_to(const std::string& address,
                                             const std::shared_ptr<grpc::ChannelCredentials>& credentials) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  return grpc::CreateCustomChannel(address, credentials, arguments);
}

absl::StatusOr<std::unique_ptr<LocalServer>> LocalServer::start(const std::string& program) {
  auto server = std::unique_ptr<LocalServer>(new LocalServer());
  if (absl::Status status = server->run(program, {}); !status.ok()) return status;
  return server;
}

std::string LocalServer::log() const { return text_of_file(folder_.file("log")); }

absl::Status LocalServer::run(const std::string& program, const std::vector<std::string>& options) {
  const std::string path = program_beside(program);
  if (path.empty())
    return absl::UnavailableError(absl::StrCat("there is no ", program, " beside this program; build it too"));
  const std::string port_file = folder_.file("port"), log = folder_.file("log");
  std::vector<std::string> words = {program, "--listen", "127.0.0.1:0", "--port-file", port_file};
  words.insert(words.end(), options.begin(), options.end());
  absl::StatusOr<std::unique_ptr<Process>> process = Process::start(path, words, log);
  if (!process.ok()) return process.status();
  process_ = *std::move(process);
  std::string port;
  for (double waited = 0; port.empty() && waited < kStartSeconds && !process_->has_ended(); waited += kPatience) {
    sleep_seconds(kPatience);
    port = text_of_file(port_file);
  }
  if (port.empty()) return absl::UnavailableError(absl::StrCat(program, " did not start: ", text_of_file(log)));
  address_ = absl::StrCat("127.0.0.1:", std::stoi(port));
  return absl::OkStatus();
}

}  // namespace locus::bench::serving
