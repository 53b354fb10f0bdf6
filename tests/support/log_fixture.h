// Members that tests of every UpdateLog share: they create scenes, append records and compare what is stored. One
// thread.
#ifndef LOCUS_TESTS_SUPPORT_LOG_FIXTURE_H_
#define LOCUS_TESTS_SUPPORT_LOG_FIXTURE_H_

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/support/stored_log.h"

namespace locus::test {

class LogFixture : public ::testing::Test {
 protected:
  void TearDown() override { log_ = nullptr; }  // before the folder or server of the derived class goes
  SceneKey create(const std::string& name, SceneKey expected) {
    const auto key = create_scene(*log_, name, expected);
    EXPECT_TRUE(key.ok()) << key.status();
    EXPECT_EQ(key.value_or(0), expected);
    return key.value_or(0);
  }
  void append(SceneKey scene, uint64_t count) { ASSERT_EQ(append_records(*log_, scene, 7, count), absl::OkStatus()); }
  // Expects that the scene's records from `first` to `last` are intact and that there are no later records.
  void expect_records(SceneKey scene, uint64_t first, uint64_t last) {
    uint64_t found = 0;
    EXPECT_EQ(record_difference(*log_, scene, first, found), "");
    EXPECT_EQ(found, last);
    EXPECT_EQ(log_->latest(scene).value_or(~uint64_t{0}), last);
  }
  void expect_snapshot(SceneKey scene, uint64_t sequence) {
    const auto chunks = read_snapshot(*log_, scene);
    ASSERT_TRUE(chunks.ok()) << chunks.status();
    EXPECT_EQ(*chunks, snapshot_chunks(scene, sequence));
  }
  absl::Status add_mesh(const std::string& name, uint8_t number, const std::vector<std::string>& chunks) {
    const ChunksFrom content(chunks), parts({"parts of", name});
    const absl::Status status = log_->add_mesh(name, hash_of(number), content, parts);
    asked_ = content.asked();
    return status;
  }

  std::unique_ptr<UpdateLog> log_;
  size_t asked_ = 0;  // chunks of the content that the last add_mesh() took
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_LOG_FIXTURE_H_
