#include "client/lib/sha256.h"

#include <gtest/gtest.h>

#include <string>

#include "absl/strings/escaping.h"

namespace locus::client {
namespace {

std::string hexadecimal(const Sha256& hash) {
  return absl::BytesToHexString({reinterpret_cast<const char*>(hash.data()), hash.size()});
}

// The texts and their hashes are the examples of FIPS 180-2.
TEST(Sha256HasherTest, HashesOfTheStandardsExamplesAreCorrect) {
  Sha256Hasher hasher;
  EXPECT_EQ(hexadecimal(hasher.finish()), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  hasher.add("abc");
  EXPECT_EQ(hexadecimal(hasher.finish()), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Sha256HasherTest, PartsHashLikeTheWholeAndFinishResetsTheHasher) {
  Sha256Hasher hasher;
  hasher.add("left over");
  hasher.finish();
  hasher.add("a");
  hasher.add("");
  hasher.add("bc");
  EXPECT_EQ(hexadecimal(hasher.finish()), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
}  // namespace locus::client
