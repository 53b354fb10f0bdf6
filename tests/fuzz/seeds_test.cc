// Runs every committed seed of every fuzz target, also in builds without libFuzzer.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <set>

#include "tests/fuzz/fuzz_target.h"

namespace locus::fuzz {
namespace {

namespace fs = std::filesystem;

const fs::path& seeds_folder() {
  static const fs::path folder = fs::path(LOCUS_SOURCE_DIR) / "tests/fuzz/seeds";
  return folder;
}

std::vector<fs::path> seeds_of(const std::string& target) {
  std::vector<fs::path> seeds;
  for (const fs::directory_entry& entry : fs::directory_iterator(seeds_folder() / target))
    seeds.push_back(entry.path());
  std::sort(seeds.begin(), seeds.end());
  return seeds;
}

std::string content_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(file), {});
}

class SeedsTest : public ::testing::TestWithParam<FuzzTarget> {};

TEST_P(SeedsTest, EverySeedKeepsTheProperties) {
  const std::vector<fs::path> seeds = seeds_of(GetParam().name);
  EXPECT_FALSE(seeds.empty());
  for (const fs::path& seed : seeds) {
    std::cout << "seed " << seed.filename().string() << std::endl;  // the last line before a target aborts
    GetParam().run(content_of(seed));
  }
}

TEST_P(SeedsTest, EveryBeginningOfASeedKeepsTheProperties) {
  for (const fs::path& seed : seeds_of(GetParam().name)) {
    const std::string whole = content_of(seed);
    const size_t step = std::max<size_t>(1, whole.size() / 64);
    std::cout << "seed " << seed.filename().string() << " cut every " << step << " bytes" << std::endl;
    for (size_t size = 0; size < whole.size(); size += step) GetParam().run(absl::string_view(whole).substr(0, size));
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, SeedsTest, ::testing::ValuesIn(targets()),
                         [](const auto& target) { return std::string(target.param.name); });

TEST(SeedFoldersTest, EveryFolderOfSeedsHasATarget) {
  std::set<std::string> names;
  for (const FuzzTarget& target : targets()) names.insert(target.name);
  for (const fs::directory_entry& entry : fs::directory_iterator(seeds_folder()))
    EXPECT_TRUE(names.contains(entry.path().filename().string())) << entry.path();
}

}  // namespace
}  // namespace locus::fuzz
