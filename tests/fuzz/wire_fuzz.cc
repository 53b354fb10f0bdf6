// Bytes of clients that are checked before Protobuf or gRPC parses them: the scan of a request, and the frames of
// HTTP/2.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>
#include <grpcpp/support/slice.h>

#include <array>
#include <memory>
#include <set>
#include <utility>

#include "core/base/refusal.h"
#include "locus/v1/query_service.pb.h"
#include "locus/v1/scene_service.pb.h"
#include "locus/v1/server_service.pb.h"
#include "locus/v1/update_service.pb.h"
#include "server/connections/frame_check.h"
#include "server/rpc/wire_plan.h"
#include "tests/fuzz/fuzz_target.h"

namespace locus::server {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::Message;
using google::protobuf::MessageFactory;

struct Request {
  const Message* prototype;
  WirePlan plan;
};

// Returns the types of all requests, each with the plan by which its messages are scanned.
const std::vector<Request>& requests() {
  static const auto* const made = [] {
    std::set<const Descriptor*> types;
    for (const Descriptor* some : {v1::QueryRequest::descriptor(), v1::ApplyUpdatesRequest::descriptor(),
                                   v1::CreateSceneRequest::descriptor(), v1::GetServerRequest::descriptor()})
      for (int service = 0; service < some->file()->service_count(); ++service)
        for (int method = 0; method < some->file()->service(service)->method_count(); ++method)
          types.insert(some->file()->service(service)->method(method)->input_type());
    auto* all = new std::vector<Request>;
    for (const Descriptor* type : types)
      all->push_back({MessageFactory::generated_factory()->GetPrototype(type), WirePlan(*type, request_limits())});
    return all;
  }();
  return *made;
}

grpc::ByteBuffer in_two_slices(absl::string_view bytes) {
  const absl::string_view first = bytes.substr(0, bytes.size() / 3), second = bytes.substr(first.size());
  const std::array<grpc::Slice, 2> slices{grpc::Slice(first.data(), first.size()),
                                          grpc::Slice(second.data(), second.size())};
  return {slices.data(), slices.size()};
}

// Verifies the scan in two ways. A message that the scan accepts takes no more memory than the scan says. A message
// that Protobuf has serialized is accepted, or refused because of a limit.
void check_request(const Request& request, absl::string_view input) {
  const absl::StatusOr<uint64_t> scanned = request.plan.scan(in_two_slices(input));
  if (!scanned.ok()) fuzz::check_error(scanned.status());
  const std::unique_ptr<Message> parsed(request.prototype->New());
  const uint64_t empty = parsed->SpaceUsedLong();
  if (!parsed->ParseFromArray(input.data(), static_cast<int>(input.size()))) return;
  if (scanned.ok()) LOCUS_CHECK_LE(parsed->SpaceUsedLong() - empty, *scanned);
  parsed->DiscardUnknownFields();
  const absl::StatusOr<uint64_t> again = request.plan.scan(in_two_slices(parsed->SerializeAsString()));
  LOCUS_CHECK(again.ok() || refusal_of(again.status())->reason == Reason::kLimit);
}

LOCUS_FUZZ_TARGET(wire) {
  for (const Request& request : requests()) check_request(request, input);
}

// Verifies that the result for the frames does not depend on the pieces in which they are read. The first byte of the
// input is the size of a piece, less 1.
LOCUS_FUZZ_TARGET(frames) {
  if (input.empty()) return;
  const size_t piece = size_t{static_cast<uint8_t>(input[0])} + 1;
  input.remove_prefix(1);
  const FrameCheck::Time now{};
  FrameCheck whole, in_pieces;
  const char* reason = nullptr;
  for (size_t at = 0; at < input.size() && reason == nullptr; at += piece)
    reason = in_pieces.refusal(input.substr(at, piece), now);
  LOCUS_CHECK(whole.refusal(input, now) == reason);
}

}  // namespace
}  // namespace locus::server
