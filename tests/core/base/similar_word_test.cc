#include "core/base/similar_word.h"

#include <gtest/gtest.h>

namespace locus {
namespace {

const std::vector<std::string> kCommands = {"scene", "mesh", "query", "list", "delete", "describe", "remove", "ray"};

TEST(SimilarWordTest, AFewEditsAreSimilar) {
  EXPECT_EQ(similar_word("qury", kCommands), "query");
  EXPECT_EQ(similar_word("qurey", kCommands), "query") << "two adjacent characters are swapped";
  EXPECT_EQ(similar_word("rays", kCommands), "ray");
  EXPECT_EQ(similar_word("sceen", kCommands), "scene");
  EXPECT_EQ(similar_word("meshh", kCommands), "mesh");
  EXPECT_EQ(similar_word("dlete", kCommands), "delete");
}

TEST(SimilarWordTest, AnAbbreviationIsSimilar) {
  EXPECT_EQ(similar_word("ls", kCommands), "list");
  EXPECT_EQ(similar_word("rm", kCommands), "remove");
  EXPECT_EQ(similar_word("desc", kCommands), "describe");
}

TEST(SimilarWordTest, OptionsAreComparedWithoutTheirDashes) {
  const std::vector<std::string> options = {"--http-listen", "--tls-cert", "--tls-key", "--k", "--from", "--rotation"};
  EXPECT_EQ(similar_word("--tls", options), "--tls-cert") << "a candidate that begins with the word";
  EXPECT_EQ(similar_word("--form", options), "--from");
  EXPECT_EQ(similar_word("rotation", options), "--rotation");
  for (const char* word : {"-m", "--n", "--at", "--port", "--json", "-", "--"})
    EXPECT_EQ(similar_word(word, options), "") << word;
}

TEST(SimilarWordTest, AWordIsSimilarToItsBeginning) {
  EXPECT_EQ(similar_word("--direction", {"--di", "--dir", "--from"}), "--dir");
  EXPECT_EQ(similar_word("removal", kCommands), "remove") << "fewer edits win";
  EXPECT_EQ(similar_word("abacus", {"ab"}), "") << "too short a beginning";
}

TEST(SimilarWordTest, OtherWordsAreNot) {
  for (const char* word : {"", "x", "frobnicate", "tsil", "overlap"})
    EXPECT_EQ(similar_word(word, kCommands), "") << word;
  EXPECT_EQ(similar_word("ray", {}), "");
}

TEST(SimilarWordTest, TheFewestEditsWinAndThenTheFirstCandidate) {
  EXPECT_EQ(similar_word("boll", {"bolt", "ball", "bowl"}), "bolt");
  EXPECT_EQ(similar_word("ball", {"bolt", "ball"}), "ball");
}

TEST(SimilarWordTest, LongWordsAreCut) {
  const std::string endless(1'000'000, 'a');
  EXPECT_EQ(similar_word(endless, {endless + "b"}), endless + "b");
  EXPECT_EQ(similar_word(endless, kCommands), "");
}

}  // namespace
}  // namespace locus
