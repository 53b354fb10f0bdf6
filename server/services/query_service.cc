#include "server/services/query_service.h"

#include <list>
#include <string>

#include "server/rpc/hot_call.h"
#include "server/services/query_work.h"

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
  Work make_work(CallSlot& slot) const { return Work(*host, slot); }
  void begin(Work& work, const std::string& scene, const Request& request, Response& response) const {
    work.begin(scene, request.batch(), *response.mutable_result());
  }

  QueryService* service;
  Host* host;
};

// Method of StreamQueries for HotCall. It writes answers as they complete, in any order.
struct StreamQueriesMethod {
  using Request = v1::StreamQueriesRequest;
  using Response = v1::StreamQueriesResponse;
  using Work = QueryWork;
  static constexpr Rpc kRpc = Rpc::kStreamQueries;
  static constexpr const char* kPath = "/locus.v1.QueryService/StreamQueries";
  static constexpr bool kStream = true;
  static constexpr bool kInOrder = false;

  void listen(grpc::ServerContext* context, grpc::ServerAsyncReaderWriter<grpc::ByteBuffer, grpc::ByteBuffer>* wire,
              grpc::ServerCompletionQueue* queue, void* tag) const {
    service->RequestStreamQueries(context, wire, queue, queue, tag);
  }
  Work make_work(CallSlot& slot) const { return Work(*host, slot); }
  void begin(Work& work, const std::string& scene, const Request& request, Response& response) const {
    work.begin(scene, request.batch(), *response.mutable_result());
  }

  QueryService* service;
  Host* host;
};

}  // namespace

struct QueryService::Listeners {
  std::list<Listener<QueryMethod>> query;
  std::list<Listener<StreamQueriesMethod>> stream;
};

QueryService::QueryService(Host& host) : host_(host), listeners_(std::make_unique<Listeners>()) {}
QueryService::~QueryService() = default;

void QueryService::listen(IoThreads& threads) {
  for (size_t i = 0; i < threads.loops(); ++i) {
    listeners_->query.emplace_back(host_, QueryMethod{this, &host_}, threads.loop(i)).listen();
    listeners_->stream.emplace_back(host_, StreamQueriesMethod{this, &host_}, threads.loop(i)).listen();
  }
}

}  // namespace locus::server
