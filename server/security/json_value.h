// Parses untrusted JSON texts with jansson, and reads their members. Functions without state; any thread.
#ifndef LOCUS_SERVER_SECURITY_JSON_VALUE_H_
#define LOCUS_SERVER_SECURITY_JSON_VALUE_H_

#include <jansson.h>

#include <memory>

#include "absl/strings/string_view.h"

namespace locus::server {

struct JsonFree {
  void operator()(json_t* value) const { json_decref(value); }
};
using JsonPointer = std::unique_ptr<json_t, JsonFree>;

// Parses a JSON object. Returns null if the text is anything else, or names a member twice.
inline JsonPointer parse_json_object(absl::string_view text) {
  JsonPointer value(json_loadb(text.data(), text.size(), JSON_REJECT_DUPLICATES, nullptr));
  return json_is_object(value.get()) ? std::move(value) : nullptr;
}

// Returns the text of a JSON string; an empty text for any other value.
inline absl::string_view json_text(const json_t* value) {
  if (!json_is_string(value)) return {};
  return {json_string_value(value), json_string_length(value)};
}

}  // namespace locus::server

#endif  // LOCUS_SERVER_SECURITY_JSON_VALUE_H_
