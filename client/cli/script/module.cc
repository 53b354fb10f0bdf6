#include "client/cli/script/module.h"

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "client/cli/failure.h"
#include "client/cli/run.h"
#include "client/cli/script/module_text.h"
#include "client/cli/script/numbers.h"
#include "client/cli/script/streams.h"
#include "client/cli/script/tables.h"
#include "client/cli/script/words.h"
#include "core/base/check.h"
#include "core/base/similar_word.h"
#include "core/base/status_macros.h"

namespace locus::cli {
namespace {

constexpr char kServer[] = "locus.server";  // name of the metatable of servers

// Server to which a script is connected: that of the program's options, or one of its own.
struct Server {
  ScriptModule& module;
  std::unique_ptr<client::Client> own;            // null: the connection of the context
  std::map<std::string, client::Revision> acked;  // last acknowledged change of each scene, for `own`

  absl::StatusOr<client::Client*> client() const {
    return own != nullptr ? absl::StatusOr<client::Client*>(own.get()) : module.context().connect();
  }
  void remember(const std::string& scene, client::Revision revision) {
    own != nullptr ? void(acked[scene] = revision) : module.context().remember_own(scene, revision);
  }
  void forget(const std::string& scene) {
    own != nullptr ? void(acked.erase(scene)) : module.context().forget_own(scene);
  }
  std::optional<client::Revision> last(const std::string& scene) const {
    if (own == nullptr) return module.context().own(scene);
    const auto found = acked.find(scene);
    return found == acked.end() ? std::nullopt : std::optional<client::Revision>(found->second);
  }
};

ScriptModule& module_of(lua_State* state) {
  return *static_cast<ScriptModule*>(lua_touserdata(state, lua_upvalueindex(1)));
}

Server& server_at(lua_State* state) { return *static_cast<Server*>(luaL_checkudata(state, 1, kServer)); }

// Returns the value of `result`, or raises its error.
template <class T>
T value_or_raise(lua_State* state, absl::StatusOr<T> result) {
  if (!result.ok()) raise(state, result.status());
  return *std::move(result);
}

void check_or_raise(lua_State* state, absl::Status status) {
  if (!status.ok()) raise(state, std::move(status));
}

client::Client& client_at(lua_State* state) {
  Server& server = server_at(state);
  server.module.sandbox().check(state);
  return *value_or_raise(state, server.client());
}

std::string text_argument(lua_State* state, int index) {
  size_t size = 0;
  const char* const text = luaL_checklstring(state, index, &size);
  return {text, size};
}

template <class M>
M message_argument(lua_State* state, int index) {
  M message;
  check_or_raise(state, read_message(state, index, message));
  return message;
}

int push_answer(lua_State* state, const google::protobuf::Message& answer) {
  push_message(state, answer);
  return 1;
}

template <class M>
int push_list(lua_State* state, const std::vector<M>& answers) {
  lua_createtable(state, static_cast<int>(answers.size()), 0);
  for (size_t i = 0; i < answers.size(); ++i) {
    push_message(state, answers[i]);
    lua_rawseti(state, -2, static_cast<lua_Integer>(i) + 1);
  }
  return 1;
}

int get_server(lua_State* state) { return push_answer(state, value_or_raise(state, client_at(state).get_server())); }

int create_scene(lua_State* state) {
  const auto request = message_argument<v1::CreateSceneRequest>(state, 2);
  return push_answer(state, value_or_raise(state, client_at(state).create_scene(request)));
}

int get_scene(lua_State* state) {
  return push_answer(state, value_or_raise(state, client_at(state).get_scene(text_argument(state, 2))));
}

int list_scenes(lua_State* state) { return push_list(state, value_or_raise(state, client_at(state).list_scenes())); }

int update_scene(lua_State* state) {
  const auto request = message_argument<v1::UpdateSceneRequest>(state, 2);
  return push_answer(state, value_or_raise(state, client_at(state).update_scene(request)));
}

int delete_scene(lua_State* state) {
  const auto request = message_argument<v1::DeleteSceneRequest>(state, 2);
  check_or_raise(state, client_at(state).delete_scene(request));
  server_at(state).forget(request.name());
  return 0;
}

int upload_mesh(lua_State* state) {
  const auto mesh = message_argument<v1::UploadMeshRequest>(state, 2);
  const std::vector<v1::MeshPart> parts(mesh.parts().begin(), mesh.parts().end());
  const client::MeshColumns columns = {mesh.mesh(), mesh.vertices(), mesh.indices(), parts};
  return push_answer(state, value_or_raise(state, client_at(state).upload_mesh(columns)));
}

int list_meshes(lua_State* state) { return push_list(state, value_or_raise(state, client_at(state).list_meshes())); }

int delete_mesh(lua_State* state) {
  check_or_raise(state, client_at(state).delete_mesh(text_argument(state, 2)));
  return 0;
}

int change_instances(lua_State* state) {
  const auto request = message_argument<v1::ChangeInstancesRequest>(state, 2);
  const v1::ChangeInstancesResponse changed = value_or_raise(state, client_at(state).change_instances(request));
  if (changed.has_revision()) server_at(state).remember(request.scene(), {changed.epoch(), changed.revision()});
  return push_answer(state, changed);
}

int apply(lua_State* state) {
  const std::string scene = text_argument(state, 2);
  const v1::UpdateAck ack =
      value_or_raise(state, client_at(state).apply(scene, message_argument<v1::UpdateBatch>(state, 3)));
  server_at(state).remember(scene, {ack.epoch(), ack.revision()});
  check_or_raise(state, refused_items(ack));
  return push_answer(state, ack);
}

// Queries that ask for no revision see the changes that the script has made.
int query(lua_State* state) {
  const std::string scene = text_argument(state, 2);
  auto batch = message_argument<v1::QueryBatch>(state, 3);
  if (const std::optional<client::Revision> last = server_at(state).last(scene); last && !batch.has_view()) {
    batch.mutable_view()->set_epoch(last->epoch);
    batch.mutable_view()->set_at_least(last->revision);
  }
  return push_answer(state, value_or_raise(state, client_at(state).query(scene, std::move(batch))));
}

// Pushes the result and the ack. Raises the error of queries that failed after the update was applied.
int step(lua_State* state) {
  const std::string scene = text_argument(state, 2);
  const client::StepResult step =
      value_or_raise(state, client_at(state).step(scene, message_argument<v1::UpdateBatch>(state, 3),
                                                  message_argument<v1::QueryBatch>(state, 4)));
  server_at(state).remember(scene, {step.ack.epoch(), step.ack.revision()});
  check_or_raise(state, refused_items(step.ack));
  check_or_raise(state, step.result.status());
  push_message(state, *step.result);
  push_message(state, step.ack);
  return 2;
}

// Returns the lease in the table of options at index 3, {lease_ms = N}; 0 if there is none.
absl::Duration lease_argument(lua_State* state) {
  if (lua_isnoneornil(state, 3)) return absl::ZeroDuration();
  luaL_checktype(state, 3, LUA_TTABLE);
  lua_pushnil(state);
  while (lua_next(state, 3) != 0) {
    lua_pop(state, 1);
    if (lua_type(state, -1) != LUA_TSTRING || absl::string_view(lua_tostring(state, -1)) != "lease_ms")
      raise(state, absl::InvalidArgumentError("a stream has no option but lease_ms"));
  }
  lua_getfield(state, 3, "lease_ms");
  const lua_Integer milliseconds = luaL_checkinteger(state, -1);
  if (milliseconds < 0 || milliseconds > std::numeric_limits<uint32_t>::max())
    raise(state, absl::InvalidArgumentError("lease_ms is a number of milliseconds, at most one day"));
  lua_pop(state, 1);
  return absl::Milliseconds(milliseconds);
}

int update_stream(lua_State* state) {
  push_stream(state, client_at(state).update_stream(text_argument(state, 2), {.lease = lease_argument(state)}));
  return 1;
}

int query_stream(lua_State* state) {
  push_stream(state, client_at(state).query_stream(text_argument(state, 2), {.lease = lease_argument(state)}));
  return 1;
}

int free_server(lua_State* state) {
  server_at(state).~Server();
  return 0;
}

// internal.open(ADDRESS): a new connection; without ADDRESS, that of the context. The token and the certificate of the
// options are sent only to the address of the options.
int open_server(lua_State* state) {
  ScriptModule& module = module_of(state);
  std::unique_ptr<client::Client> own;
  if (!lua_isnoneornil(state, 1)) {
    client::ClientOptions options;
    options.credentials = module.context().options().connection.credentials;
    const std::string address = text_argument(state, 1);
    if (address != module.context().address()) {
      options.credentials.token.clear();
      options.credentials.token_file.clear();
      options.credentials.certificate_file.clear();
      options.credentials.key_file.clear();
    }
    own = value_or_raise(state, client::Client::connect(address, options));
  } else {
    value_or_raise(state, module.context().connect());
  }
  new (lua_newuserdatauv(state, sizeof(Server), 0)) Server{module, std::move(own), {}};
  luaL_setmetatable(state, kServer);
  return 1;
}

// Returns an argument of a command as the word that a user would type: a text, a number, true or false, or a list of
// texts and numbers, which are joined by commas.
std::string word_of(lua_State* state, int index, bool is_entry = false) {
  const int type = lua_type(state, index);
  if (type == LUA_TTABLE && !is_entry && lua_rawlen(state, index) > 0) {
    std::string word;
    for (lua_Unsigned i = 1; i <= lua_rawlen(state, index); ++i) {
      lua_rawgeti(state, index, static_cast<lua_Integer>(i));
      absl::StrAppend(&word, i == 1 ? "" : ",", word_of(state, lua_gettop(state), true));
      lua_pop(state, 1);
    }
    return word;
  }
  if (type == LUA_TNUMBER && lua_isinteger(state, index) == 0) return text_of_number(lua_tonumber(state, index));
  if (type == LUA_TBOOLEAN) return lua_toboolean(state, index) != 0 ? "true" : "false";
  const std::optional<uint64_t> number = type == LUA_TUSERDATA ? to_unsigned(state, index) : std::nullopt;
  if (number) return absl::StrCat(*number);
  if (type != LUA_TSTRING && type != LUA_TNUMBER)
    raise(state, usage_error(absl::StrCat("a word of a command is a text, a number or a list of them, not a ",
                                          luaL_typename(state, index))));
  size_t size = 0;
  const char* const text = lua_tolstring(state, index, &size);
  return {text, size};
}

// Pushes the answer that a command wrote as a table; its rows are in the field `rows`, too.
void push_result(lua_State* state, const std::string& text) {
  const Json answer = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (!answer.is_object()) {
    lua_createtable(state, 0, 1);
    lua_pushlstring(state, text.data(), text.size());
    lua_setfield(state, -2, "text");
    return;
  }
  std::string rows;
  for (const auto& [key, value] : answer.items()) {
    if (value.is_array() && (value.empty() || value.front().is_object())) rows = key;
  }
  push_json(state, answer);
  if (rows.empty()) return;
  lua_getfield(state, -1, rows.c_str());
  lua_setfield(state, -2, "rows");
}

// While it exists, the context writes JSON to `answer`.
class AnswerInJson {
 public:
  AnswerInJson(Context& context, std::ostream& answer)
      : context_(context),
        out_(context.redirect_out(answer)),
        format_(std::exchange(context.options().format, Format::kJson)) {}
  ~AnswerInJson() {
    context_.options().format = format_;
    context_.redirect_out(out_);
  }
  AnswerInJson(const AnswerInJson&) = delete;
  AnswerInJson& operator=(const AnswerInJson&) = delete;

 private:
  Context& context_;
  std::ostream& out_;
  const Format format_;
};

// internal.command(LINE, WORD, ...): runs a line of the command line, with further words that are not split, and
// returns its answer.
int command(lua_State* state) {
  Context& context = module_of(state).context();
  std::vector<std::string> words = value_or_raise(state, split_words(text_argument(state, 1)));
  size_t bytes = 0;
  for (int i = 2; i <= lua_gettop(state); ++i) {
    words.push_back(word_of(state, i));
    bytes += words.back().size();
    if (bytes > kMaxScriptBytes)
      raise(state, usage_error(absl::StrCat("the words of a command have more than ", kMaxScriptBytes, " bytes")));
  }
  module_of(state).sandbox().check(state);
  std::ostringstream answer;
  absl::Status status;
  {
    const AnswerInJson redirected(context, answer);
    status = run_script_line(words, context);
  }
  check_or_raise(state, std::move(status));
  push_result(state, std::move(answer).str());
  return 1;
}

// locus.id(VALUE): the number that VALUE is or contains as text.
int id(lua_State* state) {
  const std::optional<uint64_t> value = to_unsigned(state, 1);
  if (!value)
    raise(state, usage_error(absl::StrCat("locus.id takes an integer from 0 to 18446744073709551615, not ",
                                          word_of(state, 1))));
  push_unsigned(state, *value);
  return 1;
}

// print(...): as in Lua, on the output of the command line.
int print(lua_State* state) {
  std::ostream& out = module_of(state).context().out();
  for (int i = 1; i <= lua_gettop(state); ++i) {
    size_t size = 0;
    const char* const text = luaL_tolstring(state, i, &size);
    out << (i > 1 ? "\t" : "") << absl::string_view(text, size);
    lua_pop(state, 1);
  }
  out << '\n';
  return 0;
}

absl::StatusOr<Report> report_of(lua_State* state, int index) {
  ASSIGN_OR_RETURN(Json value, read_json(state, index));
  Report report;
  Json rows = value;
  if (value.is_object()) {
    rows = value.contains("rows") ? value["rows"] : Json::array();
    for (const auto& [key, entry] : value.items()) {
      const bool is_rows = key == "rows" || (entry == rows && !rows.empty());
      if (!is_rows) report.head[key] = entry;
    }
    if (!value.contains("rows")) return report;
  }
  if (!rows.is_array()) return usage_error("locus.print takes a table: a list of rows, or a result");
  report.rows_name = "rows";
  for (Json& row : rows) report.rows.push_back(row.is_object() ? std::move(row) : Json{{"value", std::move(row)}});
  return report;
}

// locus.print(TABLE, COLUMNS): writes rows or a result in the format of -o.
int print_table(lua_State* state) {
  luaL_checktype(state, 1, LUA_TTABLE);
  Report report = value_or_raise(state, report_of(state, 1));
  if (lua_istable(state, 2)) {
    const Json keys = value_or_raise(state, read_json(state, 2));
    for (const Json& key : keys) report.keys.push_back(key.is_string() ? key.get<std::string>() : json_line(key));
  }
  module_of(state).context().write(report);
  return 0;
}

// Prints its arguments as the shell shows values: tables in the format of -o, all others as print() does.
int print_values(lua_State* state) {
  ScriptModule& module = module_of(state);
  const int values = lua_gettop(state);
  for (int i = 1; i <= values; ++i) {
    if (lua_istable(state, i)) {
      module.context().write(value_or_raise(state, report_of(state, i)));
    } else if (values > 1 || !lua_isnil(state, i)) {
      size_t size = 0;
      const char* const text = luaL_tolstring(state, i, &size);
      module.context().out() << absl::string_view(text, size) << '\n';
      lua_pop(state, 1);
    }
  }
  return 0;
}

int sleep(lua_State* state) {
  const double seconds = luaL_checknumber(state, 1);
  if (!(seconds >= 0)) raise(state, usage_error("locus.sleep takes seconds from 0 on"));
  const Sandbox& sandbox = module_of(state).sandbox();
  sandbox.wait(absl::Seconds(seconds));
  if (sandbox.interrupted()) raise(state, absl::CancelledError("interrupted"));
  return 0;
}

int now(lua_State* state) {
  lua_pushnumber(state, absl::ToDoubleSeconds(absl::Now() - absl::UnixEpoch()));
  return 1;
}

int fail(lua_State* state) { raise(state, absl::FailedPreconditionError(text_argument(state, 1))); }

// internal.suggestion(WORD, CANDIDATES): "; did you mean `x`?" or "".
int suggestion(lua_State* state) {
  std::vector<std::string> candidates;
  for (lua_Unsigned i = 1; i <= lua_rawlen(state, 2); ++i) {
    lua_rawgeti(state, 2, static_cast<lua_Integer>(i));
    candidates.push_back(text_argument(state, -1));
    lua_pop(state, 1);
  }
  const std::string similar = similar_word(text_argument(state, 1), candidates);
  lua_pushstring(state, similar.empty() ? "" : absl::StrCat("; did you mean `", similar, "`?").c_str());
  return 1;
}

// internal.count(MET, MESSAGE): counts an expectation.
int count_expectation(lua_State* state) {
  const absl::Status error =
      lua_toboolean(state, 1) != 0 ? absl::OkStatus() : absl::FailedPreconditionError(text_argument(state, 2));
  push_error(state, error);
  const absl::Status placed = status_of(state, -1);
  if (!module_of(state).count(error.ok() ? error : placed).ok()) raise(state, error);
  return 0;
}

void set_functions(lua_State* state, ScriptModule& module, const luaL_Reg* functions) {
  lua_pushlightuserdata(state, &module);
  luaL_setfuncs(state, functions, 1);
}

void create_server_metatable(lua_State* state) {
  const luaL_Reg methods[] = {{"get_server", get_server},
                              {"create_scene", create_scene},
                              {"get_scene", get_scene},
                              {"list_scenes", list_scenes},
                              {"update_scene", update_scene},
                              {"delete_scene", delete_scene},
                              {"upload_mesh", upload_mesh},
                              {"list_meshes", list_meshes},
                              {"delete_mesh", delete_mesh},
                              {"change_instances", change_instances},
                              {"apply", apply},
                              {"query", query},
                              {"step", step},
                              {"update_stream", update_stream},
                              {"query_stream", query_stream},
                              {nullptr, nullptr}};
  luaL_newmetatable(state, kServer);
  luaL_newlib(state, methods);
  lua_pushvalue(state, -1);
  lua_setfield(state, -3, "__index");
  lua_pushcfunction(state, free_server);
  lua_setfield(state, -3, "__gc");
  lua_pushliteral(state, "locus.server");
  lua_setfield(state, -3, "__metatable");  // scripts must not call __gc
  lua_remove(state, -2);
}

}  // namespace

ScriptModule::ScriptModule(Sandbox& sandbox, Context& context, AfterFailure after)
    : sandbox_(sandbox), context_(context), after_(after) {
  lua_State* const state = sandbox.state();
  open_numbers(state);
  const luaL_Reg functions[] = {{"id", id},   {"print", print_table}, {"sleep", sleep},
                                {"now", now}, {"fail", fail},         {nullptr, nullptr}};
  const luaL_Reg internal[] = {{"open", open_server},
                               {"command", command},
                               {"suggestion", suggestion},
                               {"count", count_expectation},
                               {nullptr, nullptr}};
  const luaL_Reg globals[] = {{"print", print}, {nullptr, nullptr}};
  LOCUS_CHECK_EQ(luaL_loadbufferx(state, kModuleText, sizeof kModuleText - 1, kHiddenChunk, "t"), LUA_OK);
  lua_newtable(state);
  set_functions(state, *this, functions);
  lua_pushvalue(state, -1);
  lua_setglobal(state, "locus");
  lua_getglobal(state, "package");
  lua_getfield(state, -1, "loaded");
  lua_pushvalue(state, -3);
  lua_setfield(state, -2, "locus");
  lua_pop(state, 2);
  create_server_metatable(state);
  lua_newtable(state);
  set_functions(state, *this, internal);
  LOCUS_CHECK_EQ(lua_pcall(state, 3, 0, 0), LUA_OK);
  lua_pushglobaltable(state);
  set_functions(state, *this, globals);
  lua_pop(state, 1);
}

absl::Status ScriptModule::print_results() {
  lua_State* const state = sandbox_.state();
  const int values = lua_gettop(state);
  if (lua_checkstack(state, 2) == 0) return absl::ResourceExhaustedError("too many values");
  lua_pushlightuserdata(state, this);
  lua_pushcclosure(state, print_values, 1);
  lua_insert(state, 1);
  return sandbox_.call(values, 0);
}

absl::Status ScriptModule::count(const absl::Status& error) {
  if (error.ok()) {
    ++counts_.passed;
    return error;
  }
  ++counts_.failed;
  if (after_ == AfterFailure::kStop) return error;
  write_failure(context_.err(), context_.options().format, error);
  return absl::OkStatus();
}

}  // namespace locus::cli
