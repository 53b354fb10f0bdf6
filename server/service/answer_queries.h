// One query batch from message to message: checks, the snapshot, the work, the columns.
#ifndef LOCUS_SERVER_SERVICE_ANSWER_QUERIES_H_
#define LOCUS_SERVER_SERVICE_ANSWER_QUERIES_H_

#include <string>

#include "absl/status/status.h"
#include "locus/v1/query_service.pb.h"
#include "server/service/call.h"

namespace locus::server {

// Waits for the view's revision until `wait_until`. Ends early when the caller is gone. `result` is complete or, with
// an error, of no meaning.
absl::Status answer_queries(Host& host, const Caller& caller, const std::string& scene, const v1::QueryBatch& batch,
                            SteadyTime wait_until, v1::QueryResult* result);

}  // namespace locus::server

#endif  // LOCUS_SERVER_SERVICE_ANSWER_QUERIES_H_
