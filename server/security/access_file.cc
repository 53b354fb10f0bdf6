#include "server/security/access_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "core/base/planted_bug.h"
#include "core/base/status_macros.h"
#include "server/security/glob.h"
#include "server/security/security_limits.h"
#include "server/security/text_file.h"

namespace locus::server {
namespace {

constexpr absl::string_view kConnection = "connection:";
constexpr absl::string_view kBurst = "burst_s";
constexpr double kMaxQuota = 1e18;
constexpr double kMaxBurstSeconds = 3600;
constexpr std::array<absl::string_view, 5> kPrincipalStarts = {"anonymous", "cert:", "token:", "jwt:", "user:"};

constexpr uint32_t bit_of(Right right) { return 1u << static_cast<uint32_t>(right); }

// Returns the bits of a right and of the rights that it includes.
constexpr uint32_t with_included(Right right) {
  uint32_t bits = bit_of(right);
  if (right == Right::kAdmin) bits |= bit_of(Right::kUpdate);
  if (right == Right::kAdmin || right == Right::kUpdate) bits |= bit_of(Right::kRead);
  return bits;
}

constexpr uint32_t kAllRights = (1u << kRights) - 1;
constexpr uint32_t kSceneRights = with_included(Right::kAdmin);

// Returns the words of a line up to a comment.
std::vector<absl::string_view> words_of(absl::string_view line) {
  std::vector<absl::string_view> words = absl::StrSplit(line, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
  const auto comment = std::find_if(words.begin(), words.end(), [](absl::string_view w) { return w.front() == '#'; });
  words.erase(comment, words.end());
  return words;
}

// Returns whether `pattern` can match a principal that begins with `start`, such as `token:`. If `start` has no colon
// (`anonymous`), returns whether `pattern` matches `start` itself. `head` is the part of the pattern before its first
// wildcard.
bool can_begin(absl::string_view pattern, absl::string_view head, absl::string_view start) {
  if (start.back() != ':') return glob_matches(pattern, start);
  if (absl::StartsWith(head, start)) return pattern.size() > start.size();
  return head.size() < pattern.size() && absl::StartsWith(start, head);
}

bool can_be_principal(absl::string_view pattern) {
  const absl::string_view head = pattern.substr(0, std::min(pattern.find_first_of("*?"), pattern.size()));
  return std::any_of(kPrincipalStarts.begin(), kPrincipalStarts.end(),
                     [&](absl::string_view start) { return can_begin(pattern, head, start); });
}

bool is_printable(absl::string_view word) {
  return std::all_of(word.begin(), word.end(), [](char c) { return absl::ascii_isgraph(c); });
}

bool is_scene_pattern(absl::string_view word) {
  return std::all_of(word.begin(), word.end(), [](char c) {
    return absl::ascii_islower(c) || absl::ascii_isdigit(c) || absl::StrContains("-_.*?", c);
  });
}

}  // namespace

// Parser of one access file; used once.
class AccessParser {
 public:
  explicit AccessParser(absl::string_view file) : file_(file) {}

  absl::StatusOr<AccessRules> parse(absl::string_view text) {
    if (text.size() > kMaxSecurityFileBytes)
      return refuse(absl::StrCat("the file is larger than ", kMaxSecurityFileBytes, " bytes; use wider patterns"));
    for (const absl::string_view line : absl::StrSplit(text, '\n')) {
      if (++line_ > kMaxAccessLines)
        return refuse(absl::StrCat("the file has more than ", kMaxAccessLines, " lines; use wider patterns"));
      RETURN_IF_ERROR(add_line(words_of(line)));
    }
    return std::move(rules_);
  }

 private:
  using Words = std::vector<absl::string_view>;

  absl::Status refuse(absl::string_view message) const { return refuse_line(file_, line_, message); }

  absl::Status add_line(const Words& words) {
    if (words.empty()) return absl::OkStatus();
    if (words[0] == "grant") return add_grant(words);
    if (words[0] == "quota") return add_quota(words);
    return refuse(absl::StrCat("a line begins with `grant` or `quota`, not with ", quoted_word(words[0])));
  }

  absl::Status check_principal(absl::string_view word) const {
    if (word.size() > kMaxPatternBytes || !is_printable(word))
      return refuse(absl::StrCat("a principal has at most ", kMaxPatternBytes, " printable ASCII characters, unlike ",
                                 quoted_word(word)));
    if (can_be_principal(word)) return absl::OkStatus();
    return refuse(absl::StrCat("no caller is named ", quoted_word(word),
                               "; write anonymous, cert:NAME, token:ID, jwt:SUBJECT, user:NAME or a pattern such as "
                               "token:*"));
  }

  absl::StatusOr<uint32_t> rights_of(absl::string_view word) const {
    uint32_t bits = 0;
    for (const absl::string_view name : absl::StrSplit(word, ',')) {
      const std::optional<Right> right = right_named(name);
      if (!right)
        return refuse(absl::StrCat("there is no right ", quoted_word(name), "; the rights are ",
                                   absl::StrJoin(kRightNames, ", "), ", separated by commas without spaces"));
      bits |= with_included(*right == Right::kUpdate && planted(PlantedBug::kUpdateIsAdmin) ? Right::kAdmin : *right);
    }
    return bits;
  }

  absl::Status check_scene_pattern(absl::string_view word) const {
    if (word.size() <= kMaxPatternBytes && is_scene_pattern(word)) return absl::OkStatus();
    return refuse(absl::StrCat("a scene pattern has at most ", kMaxPatternBytes,
                               " of a-z, 0-9, -, _, ., * and ?, unlike ", quoted_word(word)));
  }

  absl::Status add_grant(const Words& words) {
    if (words.size() < 3) return refuse("write `grant PRINCIPAL RIGHT[,RIGHT...] [SCENE-PATTERN...]`");
    RETURN_IF_ERROR(check_principal(words[1]));
    AccessRules::Grant grant;
    grant.principal = std::string(words[1]);
    ASSIGN_OR_RETURN(grant.rights, rights_of(words[2]));
    const bool needs_scenes = (grant.rights & kSceneRights) != 0;
    if (needs_scenes && words.size() == 3)
      return refuse("a right to scenes needs scene patterns after it; write * for all scenes");
    if (!needs_scenes && words.size() > 3)
      return refuse(absl::StrCat("a right to the server has no scene pattern; remove ", quoted_word(words[3])));
    if (words.size() - 3 > kMaxScenePatterns)
      return refuse(absl::StrCat("a grant has at most ", kMaxScenePatterns, " scene patterns; write several grants"));
    for (size_t i = 3; i < words.size(); ++i) {
      RETURN_IF_ERROR(check_scene_pattern(words[i]));
      grant.scenes.emplace_back(words[i]);
    }
    rules_.add(std::move(grant));
    return absl::OkStatus();
  }

  absl::StatusOr<double> value_of(absl::string_view name, absl::string_view text) const {
    const bool burst = name == kBurst;
    if (text == "unlimited" && !burst) return kNoQuota;
    const double max = burst ? kMaxBurstSeconds : kMaxQuota;
    double value = 0;
    if (absl::SimpleAtod(text, &value) && value >= 0 && value <= max && (!burst || value > 0)) return value;
    return refuse(absl::StrCat(name, " must be a number ", burst ? "above 0 and up to " : "from 0 to ", max,
                               burst ? "" : ", or `unlimited`", ", not ", quoted_word(text)));
  }

  absl::Status add_value(absl::string_view word, AccessRules::QuotaLine& line) const {
    const std::pair<absl::string_view, absl::string_view> parts = absl::StrSplit(word, absl::MaxSplits('=', 1));
    const std::optional<QuotaKind> kind = quota_named(parts.first);
    if (!kind && parts.first != kBurst)
      return refuse(absl::StrCat("there is no quota ", quoted_word(parts.first), "; the quotas are ",
                                 absl::StrJoin(kQuotaNames, ", "), " and ", kBurst, ", each written NAME=VALUE"));
    if (kind && !is_of_connections(*kind) && absl::StartsWith(line.subject, kConnection))
      return refuse(absl::StrCat("a connection has no quota ", parts.first,
                                 ", because what it creates stays when it ends; write it for a principal"));
    ASSIGN_OR_RETURN(const double value, value_of(parts.first, parts.second));
    const bool repeated = kind ? std::any_of(line.limits.begin(), line.limits.end(),
                                             [&](const auto& limit) { return limit.first == *kind; })
                               : line.burst_s != 0;
    if (repeated) return refuse(absl::StrCat(parts.first, " is given twice; remove one"));
    if (kind) {
      line.limits.emplace_back(*kind, value);
    } else {
      line.burst_s = value;
    }
    return absl::OkStatus();
  }

  absl::Status add_quota(const Words& words) {
    if (words.size() < 3) return refuse("write `quota PRINCIPAL NAME=VALUE...`");
    const bool connection = absl::StartsWith(words[1], kConnection) && words[1].size() > kConnection.size() &&
                            words[1].size() <= kMaxPatternBytes && is_printable(words[1]);
    if (!connection) RETURN_IF_ERROR(check_principal(words[1]));
    AccessRules::QuotaLine line;
    line.subject = std::string(words[1]);
    for (size_t i = 2; i < words.size(); ++i) RETURN_IF_ERROR(add_value(words[i], line));
    rules_.quotas_.push_back(std::move(line));
    return absl::OkStatus();
  }

  const absl::string_view file_;
  size_t line_ = 0;
  AccessRules rules_;
};

absl::StatusOr<AccessRules> AccessRules::parse(absl::string_view file, absl::string_view text) {
  return AccessParser(file).parse(text);
}

AccessRules AccessRules::all_allowed() {
  AccessRules rules;
  rules.add({"*", kAllRights, {"*"}});
  return rules;
}

AccessRules AccessRules::verified_allowed() {
  AccessRules rules;
  for (const absl::string_view principal : {"token:*", "jwt:*", "cert:*"})
    rules.add({std::string(principal), kAllRights, {"*"}});
  return rules;
}

void AccessRules::add(Grant grant) {
  if (is_glob(grant.principal)) {
    glob_grants_.push_back(std::move(grant));
  } else {
    exact_grants_[grant.principal].push_back(std::move(grant));
  }
}

template <class Visit>
bool AccessRules::any_grant(absl::string_view principal, const Visit& visit) const {
  const auto exact = exact_grants_.find(principal);
  if (exact != exact_grants_.end() && std::any_of(exact->second.begin(), exact->second.end(), visit)) return true;
  return std::any_of(glob_grants_.begin(), glob_grants_.end(),
                     [&](const Grant& grant) { return visit(grant) && glob_matches(grant.principal, principal); });
}

bool AccessRules::allows(const Identity& identity, Right right, absl::string_view scene) const {
  return any_grant(identity.principal, [&](const Grant& grant) {
    if ((grant.rights & bit_of(right)) == 0 && !planted(PlantedBug::kRightLeftOut)) return false;
    if (!is_scene_right(right) || planted(PlantedBug::kSceneLeftOut)) return true;
    return std::any_of(grant.scenes.begin(), grant.scenes.end(),
                       [&](const std::string& pattern) { return glob_matches(pattern, scene); });
  });
}

bool AccessRules::allows_all(const Identity& identity, Right right) const {
  return any_grant(identity.principal, [&](const Grant& grant) {
    const bool of_all = std::find(grant.scenes.begin(), grant.scenes.end(), "*") != grant.scenes.end();
    return of_all && (grant.rights & bit_of(right)) != 0;
  });
}

bool AccessRules::allows_any(const Identity& identity, Right right) const {
  return any_grant(identity.principal, [&](const Grant& grant) { return (grant.rights & bit_of(right)) != 0; });
}

bool AccessRules::knows(const Identity& identity) const {
  return any_grant(identity.principal, [](const Grant&) { return true; });
}

Quota AccessRules::quota_of(absl::string_view subject) const {
  Quota quota;
  const bool connection = absl::StartsWith(subject, kConnection);
  for (const QuotaLine& line : quotas_) {
    if (connection != absl::StartsWith(line.subject, kConnection) || !glob_matches(line.subject, subject)) continue;
    for (const auto& [kind, limit] : line.limits) quota.limits[static_cast<size_t>(kind)] = limit;
    if (line.burst_s > 0) quota.burst_s = line.burst_s;
  }
  return quota;
}

}  // namespace locus::server
