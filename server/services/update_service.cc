#include "server/services/update_service.h"

#include <list>
#include <string>

#include "server/rpc/hot_call.h"
#include "server/rpc/receive.h"
#include "server/services/held_updates.h"
#include "server/services/update_work.h"

namespace locus::server {
namespace {

struct ApplyUpdatesMethod {
  using Request = v1::ApplyUpdatesRequest;
  using Response = v1::ApplyUpdatesResponse;
  using Work = UpdateWork;
  static constexpr Rpc kRpc = Rpc::kApplyUpdates;
  static constexpr const char* kPath = "/locus.v1.UpdateService/ApplyUpdates";
  static constexpr bool kStream = false;
  [[maybe_unused]] static constexpr bool kInOrder = true;

  void listen(grpc::ServerContext* context, grpc::ByteBuffer* request,
              grpc::ServerAsyncResponseWriter<grpc::ByteBuffer>* wire, grpc::ServerCompletionQueue* queue,
              void* tag) const {
    service->RequestApplyUpdates(context, request, wire, queue, queue, tag);
  }
  Work make_work(CallSlot& slot) const { return Work(*host, slot); }
  static bool is_change(const Request&, const Response&) { return true; }
  void begin(Work& work, const std::string& scene, const Request& request, Response& response) const {
    work.begin(scene, request.batch(), *response.mutable_ack());
  }

  UpdateService* service;
  Host* host;
};

// Method of StreamUpdates for HotCall. It writes answers in the order of the messages, which is also the order in which
// the batches are applied.
struct StreamUpdatesMethod {
  using Request = v1::StreamUpdatesRequest;
  using Response = v1::StreamUpdatesResponse;
  using Work = UpdateWork;
  using StreamState = HeldUpdates;
  static constexpr Rpc kRpc = Rpc::kStreamUpdates;
  static constexpr const char* kPath = "/locus.v1.UpdateService/StreamUpdates";
  static constexpr bool kStream = true;
  static constexpr bool kInOrder = true;

  void listen(grpc::ServerContext* context, grpc::ServerAsyncReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer>* wire,
              grpc::ServerCompletionQueue* queue, void* tag) const {
    service->RequestStreamUpdates(context, wire, queue, queue, tag);
  }
  Work make_work(CallSlot& slot) const { return Work(*host, slot); }
  static bool is_change(const Request&, const Response&) { return true; }
  static bool continues(const Request& request) { return request.batch().continues(); }
  static bool read_continues(const grpc::ByteBuffer& bytes, Request& request) {
    const std::optional<bool> flag =
        read_flag(bytes, Request::kBatchFieldNumber, v1::UpdateBatch::kContinuesFieldNumber);
    if (flag) request.mutable_batch()->set_continues(*flag);
    return flag.has_value();
  }
  void begin(Work& work, const std::string& scene, Request& request, Response& response, HeldUpdates& held) const {
    work.begin(scene, *request.mutable_batch(), *response.mutable_ack(), held);
  }

  UpdateService* service;
  Host* host;
};

}  // namespace

struct UpdateService::Listeners {
  std::list<Listener<ApplyUpdatesMethod>> apply;
  std::list<Listener<StreamUpdatesMethod>> stream;
};

UpdateService::UpdateService(Host& host) : host_(host), listeners_(std::make_unique<Listeners>()) {}
UpdateService::~UpdateService() = default;

void UpdateService::listen(IoThreads& threads) {
  for (size_t i = 0; i < threads.loops(); ++i) {
    listeners_->apply.emplace_back(host_, ApplyUpdatesMethod{this, &host_}, threads.loop(i)).listen();
    listeners_->stream.emplace_back(host_, StreamUpdatesMethod{this, &host_}, threads.loop(i)).listen();
  }
}

}  // namespace locus::server
