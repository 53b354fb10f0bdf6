#include "tests/bench/serving/daemon.h"

#include <fstream>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "grpcpp/create_channel.h"
#include "grpcpp/security/credentials.h"
#include "grpcpp/support/channel_arguments.h"

namespace locus::bench::serving {
namespace {

constexpr double kStartSeconds = 20;
constexpr double kPatience = 0.005;

std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

}  // namespace

absl::StatusOr<std::unique_ptr<Daemon>> Daemon::start(const std::vector<std::string>& options) {
  const std::string program = program_beside("locusd");
  if (program.empty()) return absl::UnavailableError("there is no locusd beside this program; build it too");
  auto daemon = std::unique_ptr<Daemon>(new Daemon());
  const std::string port_file = daemon->folder_.file("port"), log = daemon->folder_.file("log");
  std::vector<std::string> words = {"locusd", "--listen", "127.0.0.1:0", "--port-file", port_file};
  words.insert(words.end(), options.begin(), options.end());
  absl::StatusOr<std::unique_ptr<Process>> process = Process::start(program, words, log);
  if (!process.ok()) return process.status();
  daemon->process_ = *std::move(process);
  std::string port;
  for (double waited = 0; port.empty() && waited < kStartSeconds && !daemon->process_->has_ended();
       waited += kPatience) {
    sleep_seconds(kPatience);
    port = text_of(port_file);
  }
  if (port.empty()) return absl::UnavailableError(absl::StrCat("locusd did not start: ", text_of(log)));
  daemon->address_ = absl::StrCat("127.0.0.1:", std::stoi(port));
  auto client = client::Client::connect(daemon->address_);
  if (!client.ok()) return client.status();
  daemon->client_ = *std::move(client);
  return daemon;
}

std::shared_ptr<grpc::Channel> Daemon::channel() const {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  return grpc::CreateCustomChannel(address_, grpc::InsecureChannelCredentials(), arguments);
}

}  // namespace locus::bench::serving
