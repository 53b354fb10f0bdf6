#include "client/cli/rows/bulk/ndjson_rows.h"

#include <optional>
#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "nlohmann/json.hpp"

namespace locus::cli {
namespace {

// Handler of the JSON parser's events, with one function per token. A function that returns false ends the parsing; it
// has then set `status_`.
class RowHandler final : public nlohmann::json_sax<nlohmann::json> {
 public:
  RowHandler(const RowSchema& schema, RowBuilder& builder) : schema_(schema), builder_(builder) {}

  const absl::Status& status() const { return status_; }

  bool null() override {
    if (depth_ > 0) return capture("null");
    return in_list_ ? refuse(absl::StrCat(name(), ": null in a list")) : take_absent();
  }
  bool boolean(bool value) override {
    if (depth_ > 0) return capture(value ? "true" : "false");
    return refuse(absl::StrCat(name(), ": ", value ? "true" : "false", " is no value here"));
  }
  bool number_integer(number_integer_t value) override {
    if (depth_ > 0) return capture(absl::StrCat(value));
    return put([&](const Slot& slot) { return builder_.put_number(slot, static_cast<double>(value)); });
  }
  bool number_unsigned(number_unsigned_t value) override {
    if (depth_ > 0) return capture(absl::StrCat(value));
    return put([&](const Slot& slot) { return builder_.put_integer(slot, value); });
  }
  bool number_float(number_float_t value, const string_t& text) override {
    if (depth_ > 0) return capture(text);
    return put([&](const Slot& slot) { return builder_.put_number(slot, value); });
  }
  bool string(string_t& value) override {
    if (depth_ > 0) return capture(nlohmann::json(value).dump());
    return put([&](const Slot& slot) {
      const FieldKind kind = schema_[slot.field].kind;
      if (kind == FieldKind::kId || kind == FieldKind::kBits || kind == FieldKind::kWord || kind == FieldKind::kJson) {
        return builder_.put_text(slot, value);
      }
      return absl::InvalidArgumentError(absl::StrCat(slot_name(schema_, slot), ": a string is no number"));
    });
  }
  bool binary(binary_t& /*value*/) override { return refuse("binary data"); }

  bool start_object(std::size_t /*elements*/) override {
    if (depth_ > 0) return open("{");
    if (started_) return refuse(absl::StrCat(name(), ": an object is no value here; a vector is a list of numbers"));
    started_ = true;
    return true;
  }
  bool end_object() override { return depth_ == 0 || shut("}"); }
  bool key(string_t& value) override {
    if (depth_ > 0) {
      capture(absl::StrCat(nlohmann::json(value).dump(), ":"));
      needs_comma_ = false;
      return true;
    }
    slot_ = find_slot(schema_, value);
    if (!slot_) {
      return refuse(
          absl::StrCat("unknown key '", absl::CEscape(value.substr(0, 40)), "'; known are: ", known_columns(schema_)));
    }
    const Field& field = schema_[slot_->field];
    if (field.option.empty()) return true;
    return refuse(absl::StrCat("the key ", field.name, " and the option ", field.option,
                               " are both given: leave one of them out"));
  }
  bool start_array(std::size_t /*elements*/) override {
    if (!started_) return refuse("a list, not an object in braces");
    if (depth_ > 0 || (slot_ && schema_[slot_->field].kind == FieldKind::kJson)) return open("[");
    if (in_list_ || !whole_vector()) return refuse(absl::StrCat(name(), ": a list is no value here"));
    in_list_ = true;
    next_part_ = 0;
    return true;
  }
  bool end_array() override {
    if (depth_ > 0) return shut("]");
    in_list_ = false;
    const size_t parts = schema_[slot_->field].size();
    return next_part_ == parts || refuse(absl::StrCat(name(), ": has ", next_part_, " numbers, not ", parts));
  }
  bool parse_error(std::size_t position, const std::string& /*token*/,
                   const nlohmann::detail::exception& error) override {
    // Error 406 of the parser means that a number is out of the range of double. All its other errors are syntax
    // errors.
    return refuse(error.id == 406 ? absl::StrCat(name(), ": the number at column ", position, " is beyond any double")
                                  : absl::StrCat("no JSON at column ", position));
  }

 private:
  // Append a token, or the begin or end of a list or object, to the text of a kJson field. The end of the outermost
  // list stores the text.
  bool capture(absl::string_view token) {
    absl::StrAppend(&captured_, needs_comma_ ? "," : "", token);
    needs_comma_ = true;
    return true;
  }
  bool open(absl::string_view bracket) {
    capture(bracket);
    needs_comma_ = false;
    ++depth_;
    return true;
  }
  bool shut(absl::string_view bracket) {
    captured_.append(bracket.data(), bracket.size());
    needs_comma_ = true;
    if (--depth_ > 0) return true;
    status_.Update(builder_.put_text(*slot_, captured_));
    captured_.clear();
    needs_comma_ = false;
    return status_.ok();
  }

  bool refuse(const std::string& message) {
    status_.Update(absl::InvalidArgumentError(message));
    return false;
  }
  std::string name() const { return slot_ ? slot_name(schema_, *slot_) : "the line"; }
  bool whole_vector() const { return slot_ && !slot_->part && !schema_[slot_->field].parts.empty(); }
  bool take_absent() { return started_ || refuse("null, not an object in braces"); }

  template <class Put>
  bool put(const Put& put_into) {
    if (!started_) return refuse("a single value, not an object in braces");
    if (whole_vector() && !in_list_) return refuse(absl::StrCat(name(), ": a vector is a list of numbers"));
    Slot slot = *slot_;
    if (in_list_) {
      slot.part = next_part_++;
      const size_t parts = schema_[slot.field].size();
      if (*slot.part >= parts) return refuse(absl::StrCat(name(), ": has more than ", parts, " numbers"));
    }
    status_.Update(put_into(slot));
    return status_.ok();
  }

  const RowSchema& schema_;
  RowBuilder& builder_;
  absl::Status status_;
  std::optional<Slot> slot_;  // slot of the last key read
  bool started_ = false;
  bool in_list_ = false;
  size_t next_part_ = 0;
  std::string captured_;      // text of a kJson field
  size_t depth_ = 0;          // number of open lists and objects of that text
  bool needs_comma_ = false;  // the next token of that text follows another
};

}  // namespace

absl::Status read_ndjson_row(const RowSchema& schema, absl::string_view text, uint64_t line, RowBuilder& builder,
                             RowBatch& batch) {
  builder.start();
  RowHandler handler(schema, builder);
  if (!nlohmann::json::sax_parse(text.begin(), text.end(), &handler)) return handler.status();
  return builder.finish(line, batch);
}

}  // namespace locus::cli
