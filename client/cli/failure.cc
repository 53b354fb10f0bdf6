#include "client/cli/failure.h"

#include <algorithm>
#include <optional>

#include "absl/strings/cord.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "client/lib/status.h"

namespace locus::cli {
namespace {

constexpr char kUsagePayload[] = "locus/usage";
constexpr char kReportedPayload[] = "locus/reported";

std::string name_of(v1::Reason reason) { return std::string(absl::StripPrefix(v1::Reason_Name(reason), "REASON_")); }

// Returns the hint for a reason that the server gave; empty if the hint depends only on the status code (see
// hint_of_code()).
std::string hint_of_reason(v1::Reason reason, absl::string_view message) {
  switch (reason) {
    case v1::REASON_NOT_FOUND:
      if (absl::StrContains(message, "mesh"))
        return "`locus mesh list` shows what there is; `locus import FILE --scene SCENE` uploads one";
      return "`locus scene list` shows what there is; `locus scene create NAME` makes a scene";
    case v1::REASON_LIMIT:
      if (absl::StrContains(message, "quota ")) return "`locus quota` shows your quotas and how much you use of each";
      return "`locus limits` lists every limit of this server";
    case v1::REASON_NOT_SERVED:
      return "`locus version --server` lists what this server serves";
    case v1::REASON_SCENE_RESTARTED:
      return "the scene started over: ask without --epoch, or take the new one from `locus scene describe`";
    case v1::REASON_ALREADY_EXISTS:
      return "choose another name, delete the old one, or accept it as it is (--if-absent, --create)";
    case v1::REASON_DUPLICATE_ID:
      return "choose another id, or replace the object with --upsert";
    case v1::REASON_UNKNOWN_ID:
      return "`locus get SCENE --id ID` looks for an id; `locus remove` is for objects, `locus instance remove` for "
             "instances";
    case v1::REASON_IN_USE:
      return "`locus instance list SCENE` shows the instances, `locus instance remove SCENE --id ID` removes one";
    default:
      return "";
  }
}

std::string hint_of_code(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kDeadlineExceeded:
      return client::is_read_only(status)
                 ? "give it more time with --timeout SECONDS"
                 : "give it more time with --timeout SECONDS; a change may have been made all the same";
    case absl::StatusCode::kUnimplemented:
      return "is this a locus server? `locus version --server` says which";
    case absl::StatusCode::kUnavailable:
      return "`locus health` says whether the server answers; try again when it does";
    case absl::StatusCode::kUnauthenticated:
      return "--token-file FILE gives a token, --cert and --key a certificate; `locus context set` keeps them";
    case absl::StatusCode::kPermissionDenied:
      return "ask the operator of the server for the right to do this";
    default:
      return "";
  }
}

std::string hint_of(const absl::Status& status) {
  if (status.GetPayload(kUsagePayload)) return "--help shows the options and examples";
  if (absl::StrContains(status.message(), "nothing answers")) return "";
  if (absl::StrContains(status.message(), "no connection to")) return "";
  const std::optional<v1::Error> error = client::error_of(status);
  std::string hint = error ? hint_of_reason(error->reason(), status.message()) : "";
  if (hint.empty()) hint = hint_of_code(status);
  return absl::StrContains(status.message(), hint) ? "" : hint;
}

Json failure_json(const absl::Status& status, const std::string& hint) {
  Json failure = {{"code", absl::StatusCodeToString(status.code())}, {"message", std::string(status.message())}};
  if (const std::optional<v1::Error> error = client::error_of(status)) {
    failure["reason"] = name_of(error->reason());
    if (!error->field().empty()) failure["field"] = error->field();
    if (error->has_index()) failure["index"] = error->index();
    if (!error->limit().empty()) {
      failure["limit"] = {{"name", error->limit()}, {"value", error->limit_value()}, {"asked", error->asked()}};
    }
  }
  if (!hint.empty()) failure["hint"] = hint;
  return failure;
}

}  // namespace

absl::Status usage_error(absl::string_view message) {
  absl::Status status = absl::InvalidArgumentError(message);
  status.SetPayload(kUsagePayload, absl::Cord());
  return status;
}

absl::Status reported(absl::Status status) {
  status.SetPayload(kReportedPayload, absl::Cord());
  return status;
}

bool is_reported(const absl::Status& status) { return status.GetPayload(kReportedPayload).has_value(); }

std::string failure_name(const absl::Status& status) {
  if (status.GetPayload(kUsagePayload)) return "USAGE";
  const std::optional<v1::Error> error = client::error_of(status);
  if (error && error->reason() != v1::REASON_UNSPECIFIED) return name_of(error->reason());
  return absl::StatusCodeToString(status.code());
}

bool is_failure_name(const std::string& name) {
  v1::Reason reason = v1::REASON_UNSPECIFIED;
  if (name == "USAGE") return true;
  if (v1::Reason_Parse(absl::StrCat("REASON_", name), &reason)) return reason != v1::REASON_UNSPECIFIED;
  for (int code = 1; code <= static_cast<int>(absl::StatusCode::kUnauthenticated); ++code) {
    if (name == absl::StatusCodeToString(static_cast<absl::StatusCode>(code))) return true;
  }
  return false;
}

absl::Status with_place(const absl::Status& status, absl::string_view place) {
  absl::Status placed(status.code(), absl::StrCat(place, ": ", status.message()));
  status.ForEachPayload(
      [&placed](absl::string_view type, const absl::Cord& payload) { placed.SetPayload(type, payload); });
  return placed;
}

ExitCode exit_code_of(const absl::Status& status) {
  if (status.GetPayload(kUsagePayload)) return ExitCode::kUsage;
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return ExitCode::kOk;
    case absl::StatusCode::kUnavailable:
      return ExitCode::kUnreachable;
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kUnauthenticated:
      return ExitCode::kDenied;
    case absl::StatusCode::kNotFound:
      return ExitCode::kNotFound;
    default:
      return ExitCode::kFailed;
  }
}

void write_failure(std::ostream& err, Format format, const absl::Status& status, Hints hints) {
  const std::string hint = hints == Hints::kShown ? hint_of(status) : "";
  if (format == Format::kJson || format == Format::kNdjson) {
    Report report;
    report.head["error"] = failure_json(status, hint);
    write_report(err, Format::kNdjson, report);
    return;
  }
  err << "error: " << status.message() << '\n';
  if (!hint.empty()) err << "hint: " << hint << '\n';
}

absl::Status refused_items(const v1::UpdateAck& ack) {
  if (ack.refused() == 0) return absl::OkStatus();
  std::string message = absl::StrCat(ack.refused(), " of ", ack.refused() + ack.applied(), " items refused");
  v1::Error error;
  bool all_unknown = ack.errors_size() > 0;
  for (const v1::ItemError& item : ack.errors()) all_unknown &= item.reason() == v1::REASON_UNKNOWN_ID;
  if (ack.errors_size() > 0) {
    const v1::ItemError& first = ack.errors(0);
    absl::StrAppend(&message, "; the first is ", first.field(), "[", first.index(), "], id ", first.id(), ": ",
                    name_of(first.reason()));
    error.set_reason(first.reason());
    error.set_field(first.field());
    error.set_index(first.index());
  }
  error.set_code(static_cast<int>(all_unknown ? absl::StatusCode::kNotFound : absl::StatusCode::kFailedPrecondition));
  error.set_message(message);
  return client::to_absl_status(error);
}

}  // namespace locus::cli
