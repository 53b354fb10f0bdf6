#include "client/cli/script/tables.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "client/cli/failure.h"
#include "client/cli/script/numbers.h"
#include "core/base/similar_word.h"
#include "core/base/status_macros.h"
#include "google/protobuf/descriptor.h"

namespace locus::cli {
namespace {

namespace pb = google::protobuf;

constexpr int kMaxNesting = 64;
constexpr uint64_t kMaxValues = 16'000'000;  // in one table that is read; shared tables count each time
constexpr uint64_t kBytesPerValue = 16;      // a text counts as one value for each of these

constexpr absl::string_view kUnsignedKeys[] = {"id", "group", "tag", "other", "epoch", "missing"};

bool is_unsigned_key(absl::string_view key) {
  return std::find(std::begin(kUnsignedKeys), std::end(kUnsignedKeys), key) != std::end(kUnsignedKeys);
}

// Returns what the value at `index` is, for an error.
std::string shown(lua_State* state, int index) {
  const int type = lua_type(state, index);
  if (type == LUA_TTABLE || type == LUA_TFUNCTION || type == LUA_TNIL)
    return absl::StrCat("a ", lua_typename(state, type));
  std::string text = luaL_tolstring(state, index, nullptr);
  lua_pop(state, 1);
  return type == LUA_TSTRING ? absl::StrCat("'", text.substr(0, 40), "'") : text;
}

absl::Status wrong(lua_State* state, int index, const std::string& path, absl::string_view wanted) {
  return usage_error(absl::StrCat(path, " must be ", wanted, ", not ", shown(state, index)));
}

absl::Status too_many_values() { return usage_error(absl::StrCat("the table has more than ", kMaxValues, " values")); }

std::string suggestion(const std::string& word, const std::vector<std::string>& candidates) {
  const std::string similar = similar_word(word, candidates);
  return similar.empty() ? "" : absl::StrCat("; did you mean `", similar, "`?");
}

// Returns the names of the values of an enum without their common prefix: RAY_MODE_FIRST becomes FIRST.
std::string short_name(const pb::EnumValueDescriptor& value) {
  std::string prefix;
  for (const char c : value.type()->name()) {
    if (absl::ascii_isupper(static_cast<unsigned char>(c)) && !prefix.empty()) prefix += '_';
    prefix += absl::ascii_toupper(static_cast<unsigned char>(c));
  }
  prefix += '_';
  return absl::StartsWith(value.name(), prefix) ? value.name().substr(prefix.size()) : value.name();
}

class MessageReader {
 public:
  explicit MessageReader(lua_State* state) : state_(state) {}

  absl::Status read(int index, const std::string& path, pb::Message& message) {
    if (lua_type(state_, index) != LUA_TTABLE) return wrong(state_, index, path, "a table");
    if (++depth_ > kMaxNesting || lua_checkstack(state_, 8) == 0)
      return usage_error(absl::StrCat(path, " is nested too deeply"));
    index = lua_absindex(state_, index);
    absl::Status status;
    lua_pushnil(state_);
    while (status.ok() && lua_next(state_, index) != 0) {
      status = read_entry(path, message);
      lua_pop(state_, status.ok() ? 1 : 2);
    }
    --depth_;
    return status;
  }

 private:
  // Reads the key and the value on top of the stack, and leaves them there.
  absl::Status read_entry(const std::string& path, pb::Message& message) {
    if (lua_type(state_, -2) != LUA_TSTRING)
      return usage_error(
          absl::StrCat(path.empty() ? "the table" : path, " has fields with names, not ", shown(state_, -2)));
    const std::string name = lua_tostring(state_, -2);
    const pb::FieldDescriptor* const field = message.GetDescriptor()->FindFieldByName(name);
    if (field == nullptr) {
      std::vector<std::string> names;
      for (int i = 0; i < message.GetDescriptor()->field_count(); ++i)
        names.push_back(message.GetDescriptor()->field(i)->name());
      return usage_error(
          absl::StrCat(path.empty() ? "the table" : path, " has no field '", name, "'", suggestion(name, names)));
    }
    const std::string inner = path.empty() ? name : absl::StrCat(path, ".", name);
    if (field->is_map()) return read_map(*field, inner, message);
    if (!field->is_repeated()) return set(*field, inner, message);
    return read_list(*field, inner, message, 0);
  }

  // Adds the value on top of the stack, or the values of the list there, to the repeated `field`.
  absl::Status read_list(const pb::FieldDescriptor& field, const std::string& path, pb::Message& message, int depth) {
    const bool is_message = field.cpp_type() == pb::FieldDescriptor::CPPTYPE_MESSAGE;
    if (lua_type(state_, -1) != LUA_TTABLE) return set(field, path, message);
    const auto size = static_cast<lua_Integer>(lua_rawlen(state_, -1));
    if (size == 0) {
      lua_pushnil(state_);
      if (lua_next(state_, -2) == 0) return absl::OkStatus();  // an empty list
      lua_pop(state_, 2);
      return is_message ? set(field, path, message)  // one message
                        : usage_error(absl::StrCat(path, " must be a list, not a table with names"));
    }
    if (depth > 2 || lua_checkstack(state_, 4) == 0) return usage_error(absl::StrCat(path, " is nested too deeply"));
    for (lua_Integer i = 1; i <= size; ++i) {
      lua_rawgeti(state_, -1, i);
      const std::string inner = absl::StrCat(path, "[", i, "]");
      const absl::Status status = is_message ? set(field, inner, message) : read_list(field, inner, message, depth + 1);
      lua_pop(state_, 1);
      RETURN_IF_ERROR(status);
    }
    return absl::OkStatus();
  }

  absl::Status read_map(const pb::FieldDescriptor& field, const std::string& path, pb::Message& message) {
    if (lua_type(state_, -1) != LUA_TTABLE) return wrong(state_, -1, path, "a table");
    const pb::Descriptor& entry = *field.message_type();
    absl::Status status;
    lua_pushnil(state_);
    while (status.ok() && lua_next(state_, -2) != 0) {
      pb::Message& added = *message.GetReflection()->AddMessage(&message, &field);
      status = set(*entry.FindFieldByName("value"), absl::StrCat(path, "[", shown(state_, -2), "]"), added);
      lua_pushvalue(state_, -2);
      if (status.ok()) status = set(*entry.FindFieldByName("key"), path, added);
      lua_pop(state_, status.ok() ? 2 : 3);
    }
    return status;
  }

  // Sets `field`, or adds to it if it is repeated, the value on top of the stack.
  absl::Status set(const pb::FieldDescriptor& field, const std::string& path, pb::Message& message) {
    if (++values_ > kMaxValues) return too_many_values();
    const pb::Reflection& reflection = *message.GetReflection();
    const bool repeated = field.is_repeated();
    switch (field.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_MESSAGE:
        return set_message(field, path, message);
      case pb::FieldDescriptor::CPPTYPE_ENUM:
        return set_enum(field, path, message);
      case pb::FieldDescriptor::CPPTYPE_STRING: {
        if (lua_type(state_, -1) != LUA_TSTRING) return wrong(state_, -1, path, "a text");
        size_t size = 0;
        const char* const text = lua_tolstring(state_, -1, &size);
        values_ += size / kBytesPerValue;
        repeated ? reflection.AddString(&message, &field, std::string(text, size))
                 : reflection.SetString(&message, &field, std::string(text, size));
        return absl::OkStatus();
      }
      case pb::FieldDescriptor::CPPTYPE_BOOL:
        if (lua_type(state_, -1) != LUA_TBOOLEAN) return wrong(state_, -1, path, "true or false");
        reflection.SetBool(&message, &field, lua_toboolean(state_, -1) != 0);
        return absl::OkStatus();
      case pb::FieldDescriptor::CPPTYPE_FLOAT:
      case pb::FieldDescriptor::CPPTYPE_DOUBLE:
        return set_real(field, path, message);
      default:
        return set_integer(field, path, message);
    }
  }

  absl::Status set_message(const pb::FieldDescriptor& field, const std::string& path, pb::Message& message) {
    const pb::Reflection& reflection = *message.GetReflection();
    pb::Message& inner =
        field.is_repeated() ? *reflection.AddMessage(&message, &field) : *reflection.MutableMessage(&message, &field);
    const bool vector =
        field.message_type()->name() == "Vec3d" && lua_type(state_, -1) == LUA_TTABLE && lua_rawlen(state_, -1) == 3;
    if (!vector) return read(-1, path, inner);
    for (int axis = 0; axis < 3; ++axis) {
      lua_rawgeti(state_, -1, axis + 1);
      const absl::Status status = set(*field.message_type()->field(axis), path, inner);
      lua_pop(state_, 1);
      RETURN_IF_ERROR(status);
    }
    return absl::OkStatus();
  }

  absl::Status set_enum(const pb::FieldDescriptor& field, const std::string& path, pb::Message& message) {
    if (lua_type(state_, -1) != LUA_TSTRING) return wrong(state_, -1, path, "the name of a value");
    const std::string text = lua_tostring(state_, -1);
    const std::string wanted = absl::AsciiStrToUpper(text);
    const pb::EnumDescriptor& values = *field.enum_type();
    std::vector<std::string> names;
    for (int i = 0; i < values.value_count(); ++i) {
      const pb::EnumValueDescriptor& value = *values.value(i);
      names.push_back(absl::AsciiStrToLower(short_name(value)));
      if (value.name() != wanted && short_name(value) != wanted) continue;
      field.is_repeated() ? message.GetReflection()->AddEnum(&message, &field, &value)
                          : message.GetReflection()->SetEnum(&message, &field, &value);
      return absl::OkStatus();
    }
    return usage_error(absl::StrCat(path, " has no value '", text, "'", suggestion(text, names)));
  }

  absl::Status set_real(const pb::FieldDescriptor& field, const std::string& path, pb::Message& message) {
    if (lua_type(state_, -1) != LUA_TNUMBER) return wrong(state_, -1, path, "a number");
    const pb::Reflection& reflection = *message.GetReflection();
    const double value = lua_tonumber(state_, -1);
    if (field.cpp_type() == pb::FieldDescriptor::CPPTYPE_DOUBLE) {
      field.is_repeated() ? reflection.AddDouble(&message, &field, value)
                          : reflection.SetDouble(&message, &field, value);
    } else {
      const auto rounded = static_cast<float>(value);
      field.is_repeated() ? reflection.AddFloat(&message, &field, rounded)
                          : reflection.SetFloat(&message, &field, rounded);
    }
    return absl::OkStatus();
  }

  absl::Status set_integer(const pb::FieldDescriptor& field, const std::string& path, pb::Message& message) {
    const pb::Reflection& reflection = *message.GetReflection();
    const std::optional<uint64_t> value = to_unsigned(state_, -1);
    const bool wide = field.cpp_type() == pb::FieldDescriptor::CPPTYPE_UINT64;
    const uint64_t most = wide ? std::numeric_limits<uint64_t>::max() : std::numeric_limits<uint32_t>::max();
    if (!value || *value > most) {
      return wrong(state_, -1, path,
                   absl::StrCat("an integer from 0 to ", most, wide ? " (above 2^63-1: locus.id('...'))" : ""));
    }
    const auto narrow = static_cast<uint32_t>(*value);
    switch (field.cpp_type()) {
      case pb::FieldDescriptor::CPPTYPE_UINT64:
        field.is_repeated() ? reflection.AddUInt64(&message, &field, *value)
                            : reflection.SetUInt64(&message, &field, *value);
        return absl::OkStatus();
      case pb::FieldDescriptor::CPPTYPE_UINT32:
        field.is_repeated() ? reflection.AddUInt32(&message, &field, narrow)
                            : reflection.SetUInt32(&message, &field, narrow);
        return absl::OkStatus();
      default:
        return absl::InternalError(absl::StrCat(path, " has a type that scripts cannot write"));
    }
  }

  lua_State* const state_;
  int depth_ = 0;
  uint64_t values_ = 0;
};

// Pushes the value of `field`, or its entry `i` if the field is repeated.
void push_value(lua_State* state, const pb::Message& message, const pb::FieldDescriptor& field, int i) {
  const pb::Reflection& reflection = *message.GetReflection();
  const bool repeated = field.is_repeated();
  switch (field.cpp_type()) {
    case pb::FieldDescriptor::CPPTYPE_MESSAGE:
      return push_message(
          state, repeated ? reflection.GetRepeatedMessage(message, &field, i) : reflection.GetMessage(message, &field));
    case pb::FieldDescriptor::CPPTYPE_ENUM: {
      const pb::EnumValueDescriptor& value =
          *(repeated ? reflection.GetRepeatedEnum(message, &field, i) : reflection.GetEnum(message, &field));
      lua_pushstring(state, short_name(value).c_str());
      return;
    }
    case pb::FieldDescriptor::CPPTYPE_STRING: {
      const std::string text =
          repeated ? reflection.GetRepeatedString(message, &field, i) : reflection.GetString(message, &field);
      lua_pushlstring(state, text.data(), text.size());
      return;
    }
    case pb::FieldDescriptor::CPPTYPE_BOOL:
      return lua_pushboolean(state, reflection.GetBool(message, &field));
    case pb::FieldDescriptor::CPPTYPE_FLOAT:
      return lua_pushnumber(state, static_cast<double>(repeated ? reflection.GetRepeatedFloat(message, &field, i)
                                                                : reflection.GetFloat(message, &field)));
    case pb::FieldDescriptor::CPPTYPE_DOUBLE:
      return lua_pushnumber(
          state, repeated ? reflection.GetRepeatedDouble(message, &field, i) : reflection.GetDouble(message, &field));
    case pb::FieldDescriptor::CPPTYPE_UINT64:
      return push_unsigned(
          state, repeated ? reflection.GetRepeatedUInt64(message, &field, i) : reflection.GetUInt64(message, &field));
    case pb::FieldDescriptor::CPPTYPE_UINT32:
      return lua_pushinteger(
          state, repeated ? reflection.GetRepeatedUInt32(message, &field, i) : reflection.GetUInt32(message, &field));
    default:
      return lua_pushinteger(
          state, repeated ? reflection.GetRepeatedInt32(message, &field, i) : reflection.GetInt32(message, &field));
  }
}

void push_map(lua_State* state, const pb::Message& message, const pb::FieldDescriptor& field) {
  const pb::Reflection& reflection = *message.GetReflection();
  lua_newtable(state);
  for (int i = 0; i < reflection.FieldSize(message, &field); ++i) {
    const pb::Message& entry = reflection.GetRepeatedMessage(message, &field, i);
    push_value(state, entry, *field.message_type()->FindFieldByName("key"), 0);
    push_value(state, entry, *field.message_type()->FindFieldByName("value"), 0);
    lua_rawset(state, -3);
  }
}

}  // namespace

absl::Status read_message(lua_State* state, int index, pb::Message& message) {
  return MessageReader(state).read(index, "", message);
}

void push_message(lua_State* state, const pb::Message& message) {
  luaL_checkstack(state, 8, "the message is nested too deeply");
  const pb::Reflection& reflection = *message.GetReflection();
  lua_newtable(state);
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const pb::FieldDescriptor& field = *message.GetDescriptor()->field(i);
    if (field.has_presence() && !reflection.HasField(message, &field)) continue;
    if (field.is_map()) {
      push_map(state, message, field);
    } else if (field.is_repeated()) {
      const int size = reflection.FieldSize(message, &field);
      lua_createtable(state, size, 0);
      for (int entry = 0; entry < size; ++entry) {
        push_value(state, message, field, entry);
        lua_rawseti(state, -2, entry + 1);
      }
    } else {
      push_value(state, message, field, 0);
    }
    lua_setfield(state, -2, field.name().c_str());
  }
}

namespace {

void push_json(lua_State* state, const Json& value, bool unsigned_text) {
  luaL_checkstack(state, 4, "the answer is nested too deeply");
  uint64_t number = 0;
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    if (unsigned_text && absl::SimpleAtoi(text, &number)) return push_unsigned(state, number);
    lua_pushlstring(state, text.data(), text.size());
  } else if (value.is_boolean()) {
    lua_pushboolean(state, value.get<bool>());
  } else if (value.is_number_unsigned()) {
    push_unsigned(state, value.get<uint64_t>());
  } else if (value.is_number_integer()) {
    lua_pushinteger(state, value.get<int64_t>());
  } else if (value.is_number()) {
    lua_pushnumber(state, value.get<double>());
  } else if (value.is_array()) {
    lua_createtable(state, static_cast<int>(value.size()), 0);
    lua_Integer place = 0;
    for (const Json& entry : value) {
      push_json(state, entry, unsigned_text);
      lua_rawseti(state, -2, ++place);
    }
  } else if (value.is_object()) {
    lua_newtable(state);
    for (const auto& [key, entry] : value.items()) {
      lua_pushlstring(state, key.data(), key.size());
      push_json(state, entry, is_unsigned_key(key));
      lua_rawset(state, -3);
    }
  } else {
    lua_pushnil(state);
  }
}

absl::StatusOr<Json> read_json(lua_State* state, int index, bool unsigned_text, int depth, uint64_t& values) {
  if (++values > kMaxValues) return too_many_values();
  if (depth > kMaxNesting || lua_checkstack(state, 8) == 0) return usage_error("the table is nested too deeply");
  index = lua_absindex(state, index);
  const int type = lua_type(state, index);
  if (type == LUA_TNIL) return Json();
  if (type == LUA_TBOOLEAN) return Json(lua_toboolean(state, index) != 0);
  if (type == LUA_TNUMBER || type == LUA_TUSERDATA) {
    if (const std::optional<uint64_t> number = to_unsigned(state, index)) {
      const bool whole = type == LUA_TUSERDATA || lua_isinteger(state, index) != 0;
      if (whole) return unsigned_text ? id_json(*number) : Json(*number);
    }
    if (lua_isinteger(state, index) != 0) return Json(lua_tointeger(state, index));
    if (type == LUA_TNUMBER)
      return std::isfinite(lua_tonumber(state, index)) ? Json(lua_tonumber(state, index)) : Json();
  }
  if (type != LUA_TTABLE) {
    size_t size = 0;
    const char* const text = luaL_tolstring(state, index, &size);
    values += size / kBytesPerValue;
    if (values > kMaxValues) return too_many_values();
    Json value = std::string(text, size);
    lua_pop(state, 1);
    return value;
  }
  if (lua_rawlen(state, index) > 0) {
    Json list = Json::array();
    for (lua_Unsigned i = 1; i <= lua_rawlen(state, index); ++i) {
      lua_rawgeti(state, index, static_cast<lua_Integer>(i));
      absl::StatusOr<Json> entry = read_json(state, -1, unsigned_text, depth + 1, values);
      lua_pop(state, 1);
      RETURN_IF_ERROR(entry.status());
      list.push_back(*std::move(entry));
    }
    return list;
  }
  std::map<std::string, Json> entries;
  absl::Status status;
  lua_pushnil(state);
  while (status.ok() && lua_next(state, index) != 0) {
    const std::string key = luaL_tolstring(state, -2, nullptr);
    lua_pop(state, 1);
    absl::StatusOr<Json> entry = read_json(state, -1, is_unsigned_key(key), depth + 1, values);
    status = entry.status();
    if (status.ok()) entries[key] = *std::move(entry);
    lua_pop(state, status.ok() ? 1 : 2);
  }
  RETURN_IF_ERROR(status);
  Json object = Json::object();
  if (const auto id = entries.find("id"); id != entries.end()) object["id"] = id->second;
  for (auto& [key, value] : entries) object[key] = std::move(value);
  return object;
}

}  // namespace

void push_json(lua_State* state, const Json& value) { push_json(state, value, false); }

absl::StatusOr<Json> read_json(lua_State* state, int index) {
  uint64_t values = 0;
  return read_json(state, index, false, 0, values);
}

}  // namespace locus::cli
