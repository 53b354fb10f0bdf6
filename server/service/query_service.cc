#include "server/service/query_service.h"

#include "server/service/answer_queries.h"
#include "server/service/call.h"
#include "server/service/stream_loop.h"

namespace locus::server {
namespace {

using Stream = BlockingStream<v1::StreamQueriesRequest, v1::StreamQueriesResponse>;

}  // namespace

grpc::Status QueryService::Query(grpc::ServerContext* context, const v1::QueryRequest* request,
                                 v1::QueryResponse* response) {
  return serve(host_, *context, "Query", [&](const Caller& caller) {
    return answer_queries(host_, caller, request->scene(), request->batch(), caller.wait_until(false),
                          response->mutable_result());
  });
}

RawReactor* QueryService::StreamQueries(grpc::CallbackServerContext* context) {
  return Stream::open(host_, [this, context](Stream& stream) {
    const Caller caller(host_, *context);
    const auto answer = [&](const std::string& scene, const v1::QueryBatch& batch,
                            v1::StreamQueriesResponse* response) {
      const absl::Status status =
          answer_queries(host_, caller, scene, batch, caller.wait_until(true), response->mutable_result());
      // The revision will not come any more: nobody may write. What was read is answered even so.
      if (status.code() == absl::StatusCode::kUnavailable && !host_.drain.ended())
        return absl::DeadlineExceededError("the server is shutting down before the scene reached the revision");
      return status;
    };
    return answer_all(stream, caller, "StreamQueries", answer);
  });
}

}  // namespace locus::server
