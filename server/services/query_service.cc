#include "server/services/query_service.h"

#include <list>
#include <string>

#include "server/convert/status.h"
#include "server/rpc/hot_call.h"
#include "server/services/step_work.h"

namespace locus::server {
namespace {

struct QueryMethod {
  using Request = v1::QueryRequest;
  using Response = v1::QueryResponse;
  using Work = QueryWork;
  static constexpr Rpc kRpc = Rpc::kQuery;
  static constexpr const char* kPath = "/locus.v1.QueryService/Query";
  static constexpr bool kStream = false;
  [[maybe_unused]] static constexpr bool kInOrder = false;

  void listen(grpc::ServerContext* context, grpc::ByteBuffer* request,
              grpc::ServerAsyncResponseWriter<grpc::ByteBuffer>* wire, grpc::ServerCompletionQueue* queue,
              void* tag) const {
    service->RequestQuery(context, request, wire, queue, queue, tag);
  }
  Work make_work(CallSlot& slot) const { return Work(*host, slot, kRpc); }
  static bool is_change(const Request&, const Response&) { return false; }
  void begin(Work& work, const std::string& scene, const Request& request, Response& response) const {
    work.begin(scene, request.batch(), *response.mutable_result());
  }

  QueryService* service;
  Host* host;
};

// Method of Step for HotCall.
struct StepMethod {
  using Request = v1::StepRequest;
  using Response = v1::StepResponse;
  using Work = StepWork<Response>;
  static constexpr Rpc kRpc = Rpc::kStep;
  static constexpr const char* kPath = "/locus.v1.QueryService/Step";
  static constexpr bool kStream = false;
  [[maybe_unused]] static constexpr bool kInOrder = false;

  void listen(grpc::ServerContext* context, grpc::ByteBuffer* request,
              grpc::ServerAsyncResponseWriter<grpc::ByteBuffer>* wire, grpc::ServerCompletionQueue* queue,
              void* tag) const {
    service->RequestStep(context, request, wire, queue, queue, tag);
  }
  Work make_work(CallSlot& slot) const { return Work(*host, slot, kRpc); }
  static bool is_change(const Request&, const Response& response) { return !response.has_ack(); }
  void begin(Work& work, const std::string& scene, const Request& request, Response& response) const {
    work.begin(scene, request.update(), request.queries(), response);
  }
  // Puts the error of the queries into the answer if the update was applied, because its ack must reach the caller.
  static bool put_error(const absl::Status& status, Response& response) {
    if (response.has_ack()) *response.mutable_error() = to_error(status);
    return response.has_ack();
  }

  QueryService* service;
  Host* host;
};

// Method of StreamQueries for HotCall. It writes answers as they complete, in any order.
struct StreamQueriesMethod {
  using Request = v1::StreamQueriesRequest;
  using Response = v1::StreamQueriesResponse;
  using Work = StepWork<Response>;
  static constexpr Rpc kRpc = Rpc::kStreamQueries;
  static constexpr const char* kPath = "/locus.v1.QueryService/StreamQueries";
  static constexpr bool kStream = true;
  static constexpr bool kInOrder = false;

  void listen(grpc::ServerContext* context, grpc::ServerAsyncReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer>* wire,
              grpc::ServerCompletionQueue* queue, void* tag) const {
    service->RequestStreamQueries(context, wire, queue, queue, tag);
  }
  Work make_work(CallSlot& slot) const { return Work(*host, slot, kRpc); }
  static bool is_change(const Request& request, const Response& response) {
    return request.has_update() && !response.has_ack();
  }
  void begin(Work& work, const std::string& scene, const Request& request, Response& response) const {
    if (request.has_update()) return work.begin(scene, request.update(), request.batch(), response);
    work.begin(scene, request.batch(), response);
  }

  QueryService* service;
  Host* host;
};

}  // namespace

struct QueryService::Listeners {
  std::list<Listener<QueryMethod>> query;
  std::list<Listener<StepMethod>> step;
  std::list<Listener<StreamQueriesMethod>> stream;
};

QueryService::QueryService(Host& host) : host_(host), listeners_(std::make_unique<Listeners>()) {}
QueryService::~QueryService() = default;

void QueryService::listen(IoThreads& threads) {
  for (size_t i = 0; i < threads.loops(); ++i) {
    listeners_->query.emplace_back(host_, QueryMethod{this, &host_}, threads.loop(i)).listen();
    listeners_->step.emplace_back(host_, StepMethod{this, &host_}, threads.loop(i)).listen();
    listeners_->stream.emplace_back(host_, StreamQueriesMethod{this, &host_}, threads.loop(i)).listen();
  }
}

}  // namespace locus::server
