#include "client/cli/script/streams.h"

#include <chrono>
#include <future>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/script/sandbox.h"
#include "client/cli/script/tables.h"

namespace locus::cli {
namespace {

void push_received(lua_State* state, const google::protobuf::Message& answer) { push_message(state, answer); }

void push_received(lua_State* state, const client::StepResult& step) {
  lua_createtable(state, 0, 2);
  push_message(state, step.ack);
  lua_setfield(state, -2, "ack");
  step.result.ok() ? push_message(state, *step.result) : push_error(state, step.result.status());
  lua_setfield(state, -2, "result");
}

template <class Stream, class Batch, class Answer>
struct StreamObject {
  using Pending = std::variant<std::future<absl::StatusOr<Answer>>, std::future<absl::StatusOr<client::StepResult>>>;

  static constexpr const char* kName =  // of the metatable
      std::is_same_v<Stream, client::UpdateStream> ? "locus.update_stream" : "locus.query_stream";
  static constexpr size_t kMaxUnread = 1000;  // answers that wait for flush()
  static constexpr std::chrono::milliseconds kPoll{20};

  std::unique_ptr<Stream> stream;
  std::vector<Pending> answers;
  uint64_t sent = 0;

  static StreamObject& self(lua_State* state) { return *static_cast<StreamObject*>(luaL_checkudata(state, 1, kName)); }

  static int send(lua_State* state) {
    StreamObject& object = self(state);
    Batch batch;
    if (absl::Status status = read_message(state, 2, batch); !status.ok()) raise(state, std::move(status));
    object.check_unread(state);
    return object.add(state, object.stream->send(std::move(batch)));
  }

  // Sends a list of batches that become one revision. Only streams of updates have this method.
  static int send_together(lua_State* state) {
    StreamObject& object = self(state);
    luaL_checktype(state, 2, LUA_TTABLE);
    std::vector<v1::UpdateBatch> batches(lua_rawlen(state, 2));
    for (size_t i = 0; i < batches.size(); ++i) {
      lua_rawgeti(state, 2, static_cast<lua_Integer>(i + 1));
      if (absl::Status status = read_message(state, lua_gettop(state), batches[i]); !status.ok()) {
        std::vector<v1::UpdateBatch>().swap(batches);  // raise() does not return and runs no destructors
        raise(state, std::move(status));
      }
      lua_pop(state, 1);
    }
    object.check_unread(state);
    if constexpr (std::is_same_v<Stream, client::UpdateStream>)
      return object.add(state, object.stream->send_together(std::move(batches)));
    return 0;
  }

  // Sends a step. Only streams of queries have this method.
  static int step(lua_State* state) {
    StreamObject& object = self(state);
    v1::UpdateBatch update;
    v1::QueryBatch queries;
    absl::Status status = read_message(state, 2, update);
    if (status.ok()) status = read_message(state, 3, queries);
    if (!status.ok()) raise(state, std::move(status));
    object.check_unread(state);
    if constexpr (std::is_same_v<Stream, client::QueryStream>)
      return object.add(state, object.stream->step(std::move(update), std::move(queries)));
    return 0;
  }

  void check_unread(lua_State* state) const {
    if (answers.size() >= kMaxUnread)
      raise(state, absl::ResourceExhaustedError(
                       absl::StrCat(kMaxUnread, " answers wait to be read: call flush() more often")));
  }

  int add(lua_State* state, Pending answer) {
    answers.push_back(std::move(answer));
    lua_pushinteger(state, static_cast<lua_Integer>(++sent));
    return 1;
  }

  static int flush(lua_State* state) {
    StreamObject& object = self(state);
    Sandbox& sandbox = Sandbox::of(state);
    std::vector<Pending> answers = std::exchange(object.answers, {});
    lua_createtable(state, static_cast<int>(answers.size()), 0);
    lua_Integer place = 0;
    for (Pending& answer : answers) {
      std::visit([&](auto& pending) { await(state, sandbox, pending); }, answer);
      lua_rawseti(state, -2, ++place);
    }
    return 1;
  }

  // Waits for an answer and pushes it.
  template <class Pushed>
  static void await(lua_State* state, Sandbox& sandbox, std::future<absl::StatusOr<Pushed>>& answer) {
    while (answer.wait_for(kPoll) != std::future_status::ready) {
      sandbox.check(state);
    }
    const absl::StatusOr<Pushed> got = answer.get();
    got.ok() ? push_received(state, *got) : push_error(state, got.status());
  }

  static int close(lua_State* state) {
    flush(state);
    if (absl::Status status = self(state).stream->close(); !status.ok()) raise(state, std::move(status));
    return 1;
  }

  static int free(lua_State* state) {
    self(state).~StreamObject();
    return 0;
  }

  static void push(lua_State* state, std::unique_ptr<Stream> stream) {
    new (lua_newuserdatauv(state, sizeof(StreamObject), 0)) StreamObject{std::move(stream), {}, 0};
    if (luaL_newmetatable(state, kName) != 0) {
      const bool has_steps = std::is_same_v<Stream, client::QueryStream>;
      const luaL_Reg own = has_steps ? luaL_Reg{"step", step} : luaL_Reg{"send_together", send_together};
      const luaL_Reg methods[] = {{"send", send}, {"flush", flush}, {"close", close}, own, {nullptr, nullptr}};
      luaL_newlib(state, methods);
      lua_setfield(state, -2, "__index");
      lua_pushcfunction(state, free);
      lua_setfield(state, -2, "__gc");
      lua_pushliteral(state, "locus.stream");
      lua_setfield(state, -2, "__metatable");  // scripts must not call __gc
    }
    lua_setmetatable(state, -2);
  }
};

}  // namespace

void push_stream(lua_State* state, std::unique_ptr<client::UpdateStream> stream) {
  StreamObject<client::UpdateStream, v1::UpdateBatch, v1::UpdateAck>::push(state, std::move(stream));
}

void push_stream(lua_State* state, std::unique_ptr<client::QueryStream> stream) {
  StreamObject<client::QueryStream, v1::QueryBatch, v1::QueryResult>::push(state, std::move(stream));
}

}  // namespace locus::cli
