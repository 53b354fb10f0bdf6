#include "server/rpc/stream_counter.h"

#include <grpc/grpc.h>
#include <grpc/support/alloc.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/string_view.h"

namespace locus::server {
namespace {

using std::chrono::steady_clock;
using Json = nlohmann::json;

constexpr intptr_t kSocketsAtOnce = 256;
// Minimum interval between two requests for the channelz ids of all connections. All other requests are for ids above
// the highest known one, so they miss a connection that gRPC lists only after a connection with a higher id.
constexpr std::chrono::seconds kAskAllInterval{1};

// Parses a text that gRPC has allocated, and frees it. Returns a discarded value if `text` is null or not JSON.
Json parse_channelz(char* text) {
  const std::unique_ptr<char, decltype(&gpr_free)> owned(text, &gpr_free);
  return Json::parse(text == nullptr ? "" : text, nullptr, /*allow_exceptions=*/false);
}

// Returns the number in a field; 0 if the field is missing. Channelz writes 64-bit numbers as texts and omits zeros.
int64_t number_in(const Json& object, const char* field) {
  int64_t number = 0;
  const auto found = object.find(field);
  if (found == object.end() || !found->is_string()) return 0;
  return absl::SimpleAtoi(found->get_ref<const std::string&>(), &number) ? number : 0;
}

// Returns the elements of an array in a field; an empty array if the field is missing.
Json list_in(const Json& object, const char* field) {
  return object.is_object() && object.contains(field) && object[field].is_array() ? object[field] : Json::array();
}

}  // namespace

std::optional<uint64_t> StreamCounter::count(Connection& connection) {
  if (connection.transport_id.load() == 0) learn_numbers();
  const int64_t number = connection.transport_id.load();
  if (number == 0) return std::nullopt;
  const Json socket = parse_channelz(grpc_channelz_get_socket(static_cast<intptr_t>(number)));
  const Json data = socket.is_object() ? socket.value(Json::json_pointer("/socket/data"), Json::object()) : Json();
  if (!data.is_object()) return std::nullopt;
  return static_cast<uint64_t>(std::max<int64_t>(
      0, number_in(data, "streamsStarted") - number_in(data, "streamsSucceeded") - number_in(data, "streamsFailed")));
}

void StreamCounter::learn_numbers() {
  if (const steady_clock::time_point now = steady_clock::now(); now >= ask_all_at_) {
    ask_all_at_ = now + kAskAllInterval;
    next_number_ = 0;
  }
  const int64_t first = next_number_;
  for (const Json& server : list_in(parse_channelz(grpc_channelz_get_servers(0)), "server")) {
    const int64_t id = number_in(server.value("ref", Json::object()), "serverId");
    for (int64_t next = first; next >= 0;) {
      const Json page = parse_channelz(grpc_channelz_get_server_sockets(id, next, kSocketsAtOnce));
      next = -1;
      for (const Json& socket : list_in(page, "socketRef")) {
        const int64_t number = number_in(socket, "socketId");
        next = number + 1;
        next_number_ = std::max(next_number_, next);
        // gRPC names a socket TRANSPORT PEER; the table finds a connection by its PEER.
        const std::string name = socket.value("name", "");
        const size_t space = name.rfind(' ');
        if (space != std::string::npos) table_.find(absl::string_view(name).substr(space + 1))->transport_id = number;
      }
    }
  }
}

}  // namespace locus::server
