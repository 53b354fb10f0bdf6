#include "server/security/access_control.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/security/text_file.h"
#include "server/security/token_file.h"
#include "tests/support/random.h"
#include "tests/support/signing_key.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_scale.h"

namespace locus::server {
namespace {

using test::SigningKey;
using testing::HasSubstr;

constexpr int64_t kNow = 1'700'000'000;

Credentials bearer(absl::string_view text) {
  Credentials made;
  made.bearer = text;
  return made;
}

class AccessControlTest : public testing::Test {
 protected:
  void write(const std::string& file, const std::string& text) {
    ASSERT_TRUE(replace_text_file(file, text, 0600).ok());
  }
  // Replaces a file without waiting for the disk.
  void replace_fast(const std::string& file, const std::string& text) {
    std::ofstream(file + ".new") << text;
    std::filesystem::permissions(file + ".new", std::filesystem::perms(0600));
    std::filesystem::rename(file + ".new", file);
  }
  std::string add(const std::string& id, std::optional<int64_t> expires = std::nullopt) {
    const absl::StatusOr<std::string> token = add_token(options_.token_file, id, kNow, expires, "");
    EXPECT_TRUE(token.ok()) << token.status();
    return token.ok() ? *token : "";
  }
  // Configures all three files and writes them: two grants, no token, and the key set of key().
  void use_all_files() {
    options_.access_file = folder_.file("access");
    options_.token_file = folder_.file("tokens");
    options_.jwks_file = folder_.file("keys");
    options_.jwt_audience = "locus";
    write(options_.access_file, "grant token:ci read,update arena-*\ngrant anonymous read lobby\n");
    write(options_.token_file, "");
    write(options_.jwks_file, key_set(key()));
  }
  absl::StatusOr<std::unique_ptr<AccessControl>> try_open() {
    return AccessControl::open(options_, [this] { return now_.load(); });
  }
  std::unique_ptr<AccessControl> open() {
    absl::StatusOr<std::unique_ptr<AccessControl>> opened = try_open();
    EXPECT_TRUE(opened.ok()) << opened.status();
    return opened.ok() ? *std::move(opened) : nullptr;
  }
  static const SigningKey& key() {
    static const auto* const key = new SigningKey(SigningKey::ed25519());
    return *key;
  }
  static std::string key_set(const SigningKey& key) { return absl::StrCat(R"({"keys":[)", key.jwk(), "]}"); }
  static std::string jwt(const SigningKey& key) {
    return key.jwt(R"({"alg":"EdDSA"})", absl::StrCat(R"({"sub":"ann","aud":"locus","exp":)", kNow + 100, "}"));
  }
  static bool allows(const AccessControl& control, const Credentials& credentials, Right right, const char* scene) {
    const absl::StatusOr<IdentityPtr> identity = control.authenticate(credentials);
    return identity.ok() && control.rules()->allows(**identity, right, scene);
  }

  test::TemporaryFolder folder_;
  SecurityOptions options_;
  std::atomic<int64_t> now_{kNow};
};

TEST_F(AccessControlTest, WithoutFilesEverybodyIsAnonymousAndMayDoEverything) {
  const auto control = open();
  EXPECT_FALSE(control->enabled());
  Credentials credentials = bearer("any token at all");
  credentials.certificate_name = "ops";
  EXPECT_EQ((*control->authenticate(credentials))->principal, "anonymous");
  for (size_t i = 0; i < kRights; ++i) EXPECT_TRUE(allows(*control, credentials, static_cast<Right>(i), "any"));
  EXPECT_EQ(control->audit(), nullptr);
  EXPECT_TRUE(control->files().empty());
}

TEST_F(AccessControlTest, ATokenFileAloneAllowsEverythingToItsTokensAndNothingToOthers) {
  options_.token_file = folder_.file("tokens");
  const std::string token = add("ci");
  const auto control = open();
  EXPECT_TRUE(control->enabled());
  EXPECT_TRUE(allows(*control, bearer(token), Right::kAdmin, "any"));
  EXPECT_TRUE(allows(*control, bearer(token), Right::kBackup, ""));
  EXPECT_FALSE(allows(*control, {}, Right::kRead, "any"));
  EXPECT_FALSE(control->rules()->knows(**control->authenticate({})));
}

TEST_F(AccessControlTest, ABearerIsUsedRatherThanACertificateRatherThanAUser) {
  use_all_files();
  const std::string token = add("ci");
  const auto control = open();
  Credentials all = bearer(token);
  all.certificate_name = "ops";
  all.unix_uid = 0;
  all.local = true;
  EXPECT_EQ((*control->authenticate(all))->principal, "token:ci");
  const std::string ann = jwt(key());
  all.bearer = ann;
  EXPECT_EQ((*control->authenticate(all))->principal, "jwt:ann");
  all.bearer = {};
  EXPECT_EQ((*control->authenticate(all))->principal, "cert:ops");
  all.certificate_name = {};
  EXPECT_EQ((*control->authenticate(all))->principal, "user:root");
  all.unix_uid = 4'000'000'000;
  EXPECT_EQ((*control->authenticate(all))->principal, "user:4000000000");
  all.local = false;
  EXPECT_EQ((*control->authenticate(all))->principal, "anonymous");
}

TEST_F(AccessControlTest, AWrongBearerIsRefusedEvenBesideACertificate) {
  use_all_files();
  add("ci");
  const auto control = open();
  for (const std::string& wrong : {std::string("x"), "locus_ci_" + std::string(43, 'a'), std::string(9000, 'a'),
                                   std::string("a.b.c"), std::string("\0", 1)}) {
    Credentials credentials = bearer(wrong);
    credentials.certificate_name = "ops";
    EXPECT_EQ(control->authenticate(credentials).status().code(), absl::StatusCode::kUnauthenticated);
  }
}

TEST_F(AccessControlTest, TheRefusalOfATokenDoesNotSayWhetherItsIdExists) {
  use_all_files();
  const std::string token = add("ci", kNow + 5), revoked = add("old");
  ASSERT_TRUE(revoke_token(options_.token_file, "old").ok());
  const auto control = open();
  now_ = kNow + 5;
  const absl::Status expired = control->authenticate(bearer(token)).status();
  for (const std::string& wrong : {"locus_ci_" + std::string(43, 'a'), "locus_none_" + std::string(43, 'a'), revoked,
                                   std::string("locus_"), token.substr(0, token.size() - 1)}) {
    EXPECT_EQ(control->authenticate(bearer(wrong)).status(), expired) << wrong;
  }
}

TEST_F(AccessControlTest, WithoutAFileForThemTokensAndJwtsAreRefused) {
  options_.access_file = folder_.file("access");
  write(options_.access_file, "grant * admin *\n");
  const auto control = open();
  EXPECT_TRUE(allows(*control, {}, Right::kAdmin, "any"));
  EXPECT_FALSE(control->authenticate(bearer("locus_ci_" + std::string(43, 'a'))).ok());
  EXPECT_FALSE(control->authenticate(bearer(jwt(key()))).ok());
}

TEST_F(AccessControlTest, AReloadRevokesTokensAndRights) {
  use_all_files();
  const std::string token = add("ci");
  const auto control = open();
  const uint64_t generation = control->generation();
  const IdentityPtr identity = *control->authenticate(bearer(token));
  EXPECT_TRUE(control->rules()->allows(*identity, Right::kUpdate, "arena-1"));
  EXPECT_TRUE(control->still_valid(*identity));

  write(options_.access_file, "grant token:ci read arena-*\n");
  EXPECT_TRUE(control->rules()->allows(*identity, Right::kUpdate, "arena-1")) << "nothing was reloaded yet";
  ASSERT_TRUE(control->reload().ok());
  EXPECT_GT(control->generation(), generation);
  EXPECT_FALSE(control->rules()->allows(*identity, Right::kUpdate, "arena-1"));
  EXPECT_TRUE(control->still_valid(*identity));

  ASSERT_TRUE(revoke_token(options_.token_file, "ci").ok());
  ASSERT_TRUE(control->reload().ok());
  EXPECT_FALSE(control->still_valid(*identity));
  EXPECT_FALSE(control->authenticate(bearer(token)).ok());
}

TEST_F(AccessControlTest, ReplacingATokenEndsTheOldOne) {
  use_all_files();
  const std::string old = add("ci");
  const auto control = open();
  const IdentityPtr identity = *control->authenticate(bearer(old));
  ASSERT_TRUE(revoke_token(options_.token_file, "ci").ok());
  const std::string made = add("ci");
  ASSERT_TRUE(control->reload().ok());
  EXPECT_FALSE(control->still_valid(*identity));
  EXPECT_FALSE(control->authenticate(bearer(old)).ok());
  EXPECT_TRUE(control->still_valid(**control->authenticate(bearer(made))));
}

TEST_F(AccessControlTest, IdentitiesEndWhenTheirCredentialsExpire) {
  use_all_files();
  const std::string token = add("ci", kNow + 200), ann = jwt(key());
  const auto control = open();
  const IdentityPtr by_token = *control->authenticate(bearer(token)), by_jwt = *control->authenticate(bearer(ann));
  now_ = kNow + 159;
  EXPECT_TRUE(control->still_valid(*by_token));
  EXPECT_TRUE(control->still_valid(*by_jwt));
  now_ = kNow + 160;  // the JWT's expiry, kNow + 100, plus kJwtSkewSeconds
  EXPECT_FALSE(control->still_valid(*by_jwt));
  EXPECT_FALSE(control->authenticate(bearer(ann)).ok());
  now_ = kNow + 200;
  EXPECT_FALSE(control->still_valid(*by_token));
  EXPECT_FALSE(control->authenticate(bearer(token)).ok());
  EXPECT_TRUE(control->still_valid(*anonymous_identity()));
}

TEST_F(AccessControlTest, AKeyThatIsReplacedEndsItsJwts) {
  use_all_files();
  const auto control = open();
  const std::string ann = jwt(key());
  const IdentityPtr identity = *control->authenticate(bearer(ann));
  EXPECT_TRUE(control->still_valid(*identity));
  const SigningKey other = SigningKey::ed25519();
  write(options_.jwks_file, key_set(other));
  ASSERT_TRUE(control->reload().ok());
  EXPECT_FALSE(control->still_valid(*identity));
  EXPECT_FALSE(control->authenticate(bearer(ann)).ok());
  EXPECT_TRUE(control->authenticate(bearer(jwt(other))).ok());
}

TEST_F(AccessControlTest, AReloadWithAMistakeInAnyFileChangesNothing) {
  use_all_files();
  const std::string token = add("ci");
  const std::string tokens = read_text_file(options_.token_file)->text;
  const auto control = open();
  const uint64_t generation = control->generation();
  int calls = 0;
  control->on_change([&] { ++calls; });
  const std::string good_access = "grant token:ci read lobby\n";
  for (const std::string* const file : {&options_.access_file, &options_.token_file, &options_.jwks_file}) {
    write(options_.access_file, good_access);
    write(options_.token_file, "");
    write(options_.jwks_file, key_set(SigningKey::ed25519()));
    write(*file, "mistake\n");
    const absl::Status status = control->reload();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(status.message()), HasSubstr(*file));
    std::filesystem::remove(*file);
    EXPECT_EQ(control->reload().code(), absl::StatusCode::kNotFound);
    EXPECT_TRUE(allows(*control, bearer(token), Right::kUpdate, "arena-1")) << *file;
    EXPECT_TRUE(control->authenticate(bearer(jwt(key()))).ok()) << *file;
  }
  EXPECT_EQ(control->generation(), generation);
  EXPECT_EQ(calls, 0);
  use_all_files();
  write(options_.token_file, tokens);
  ASSERT_TRUE(control->reload().ok());
  EXPECT_EQ(calls, 1);
}

TEST_F(AccessControlTest, FilesWithMistakesAreNotOpened) {
  use_all_files();
  open();
  for (const std::string* const file : {&options_.access_file, &options_.token_file, &options_.jwks_file}) {
    const std::string text = read_text_file(*file)->text;
    write(*file, "mistake\n");
    EXPECT_EQ(try_open().status().code(), absl::StatusCode::kInvalidArgument) << *file;
    std::filesystem::remove(*file);
    EXPECT_EQ(try_open().status().code(), absl::StatusCode::kNotFound) << *file;
    ASSERT_TRUE(replace_text_file(*file, text, 0660).ok());
    EXPECT_EQ(try_open().status().code(), absl::StatusCode::kFailedPrecondition) << *file;
    write(*file, text);
  }
  open();
}

TEST_F(AccessControlTest, OptionsThatContradictEachOtherAreRefused) {
  use_all_files();
  options_.jwt_audience.clear();
  EXPECT_EQ(try_open().status().code(), absl::StatusCode::kInvalidArgument);
  options_.jwks_file.clear();
  open();
  options_.jwt_audience = "locus";
  EXPECT_EQ(try_open().status().code(), absl::StatusCode::kInvalidArgument);
  options_.jwt_audience.clear();
  options_.audit_file = folder_.file("audit");
  options_.audit_bytes = 100;
  EXPECT_EQ(try_open().status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(AccessControlTest, AReadableTokenFileIsWarnedOf) {
  use_all_files();
  EXPECT_TRUE(open()->warnings().empty());
  std::filesystem::permissions(options_.token_file, std::filesystem::perms(0644));
  EXPECT_THAT(open()->warnings(), testing::ElementsAre(HasSubstr("chmod o-r")));
}

TEST_F(AccessControlTest, ReloadOpensTheAuditFileAnew) {
  use_all_files();
  options_.audit_file = folder_.file("audit");
  const auto control = open();
  std::filesystem::rename(options_.audit_file, options_.audit_file + ".moved");
  ASSERT_TRUE(control->reload().ok());
  control->audit()->write({});
  control->audit()->flush();
  EXPECT_GT(std::filesystem::file_size(options_.audit_file), 0u);
}

TEST_F(AccessControlTest, RandomBearersAreNeverAccepted) {
  use_all_files();
  const std::string token = add("ci");
  const auto control = open();
  for (uint64_t seed = 1; seed <= test::scaled_count(20000); ++seed) {
    test::Random random(seed);
    std::string bytes = random.chance(0.5) ? token : jwt(key());
    if (random.chance(0.5)) bytes.resize(random.below(bytes.size()));
    bytes.insert(random.below(bytes.size() + 1), 1, static_cast<char>(random.below(256)));
    EXPECT_FALSE(control->authenticate(bearer(bytes)).ok()) << "seed " << seed;
  }
}

// The files alternate between two states. In one state, token `even` may read the scene `even`, and token `odd` is
// revoked; in the other state, `odd` may read the scene `odd`, and `even` is revoked. Every reader must see one
// complete state, and the new state directly after a reload.
TEST_F(AccessControlTest, ReadersAtFullSpeedSeeWholeStatesWhileFilesAreReloaded) {
  use_all_files();
  const std::string tokens[2] = {add("even"), add("odd")};
  const std::string both = read_text_file(options_.token_file)->text;
  const size_t half = both.find('\n') + 1;
  const std::string lines[2] = {both.substr(0, half), both.substr(half)};
  const std::string access[2] = {"grant token:even read even\n", "grant token:odd read odd\n"};
  const auto publish = [&](size_t state) {
    replace_fast(options_.access_file, access[state]);
    replace_fast(options_.token_file, lines[state]);
  };
  publish(0);
  const auto control = open();
  std::atomic<uint64_t> changes{0};
  control->on_change([&] { changes.fetch_add(1); });
  std::atomic<bool> done{false};
  std::atomic<uint64_t> looks{0}, wrong{0};
  Identity even, odd;
  even.principal = "token:even";
  odd.principal = "token:odd";
  std::vector<std::thread> readers;
  for (int t = 0; t < 3; ++t)
    readers.emplace_back([&] {
      while (!done.load()) {
        const auto identity = control->authenticate(bearer(tokens[0]));
        if (identity.ok() && (*identity)->principal != "token:even") wrong.fetch_add(1);
        if (identity.ok()) (void)control->still_valid(**identity);
        const auto rules = control->rules();
        // In each state exactly one of the two tokens may read.
        if (rules->allows(even, Right::kRead, "even") == rules->allows(odd, Right::kRead, "odd")) wrong.fetch_add(1);
        looks.fetch_add(1);
      }
    });
  const uint64_t reloads = test::scaled_count(1000);
  for (uint64_t i = 1; i <= reloads; ++i) {
    publish(i % 2);
    ASSERT_TRUE(control->reload().ok());
    EXPECT_EQ(control->authenticate(bearer(tokens[i % 2])).ok(), true) << i;
    EXPECT_EQ(control->authenticate(bearer(tokens[1 - i % 2])).ok(), false) << i;
  }
  while (looks.load() < 100) std::this_thread::yield();
  done = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(wrong.load(), 0u);
  EXPECT_EQ(changes.load(), reloads);
  EXPECT_EQ(control->generation(), 1 + reloads);
}

}  // namespace
}  // namespace locus::server
