#include "server/config/machine.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <filesystem>
#include <fstream>

namespace locus::server {
namespace {

namespace fs = std::filesystem;

// Fixture with a temporary folder in which tests write the files of control groups.
class MachineTest : public testing::Test {
 protected:
  MachineTest() : root_(testing::TempDir() + "machine_" + test_name()) { fs::remove_all(root_); }
  ~MachineTest() override { fs::remove_all(root_); }

  static std::string test_name() { return testing::UnitTest::GetInstance()->current_test_info()->name(); }

  void write(const std::string& path, const std::string& text) {
    fs::create_directories(fs::path(root_ + path).parent_path());
    std::ofstream(root_ + path) << text;
  }
  CgroupLimits read() const { return read_cgroup_limits(root_); }

  const std::string root_;
};

TEST_F(MachineTest, CgroupVersionTwoLimitsCoresRoundedUpAndMemory) {
  write("/proc/self/cgroup", "0::/\n");
  write("/sys/fs/cgroup/cpu.max", "150000 100000\n");
  write("/sys/fs/cgroup/memory.max", "268435456\n");
  EXPECT_EQ(read().cores, 2u);
  EXPECT_EQ(read().memory_bytes, 268435456u);
}

TEST_F(MachineTest, LessThanOneCoreCountsAsOne) {
  write("/proc/self/cgroup", "0::/\n");
  write("/sys/fs/cgroup/cpu.max", "10000 100000\n");
  EXPECT_EQ(read().cores, 1u);
}

TEST_F(MachineTest, TheLowestLimitOfAllParentGroupsApplies) {
  write("/proc/self/cgroup", "0::/pod/container\n");
  write("/sys/fs/cgroup/pod/container/memory.max", "900\n");
  write("/sys/fs/cgroup/pod/container/cpu.max", "100000 100000\n");
  write("/sys/fs/cgroup/pod/memory.max", "500\n");
  write("/sys/fs/cgroup/pod/cpu.max", "400000 100000\n");
  write("/sys/fs/cgroup/memory.max", "max\n");
  EXPECT_EQ(read().memory_bytes, 500u);
  EXPECT_EQ(read().cores, 1u);
}

TEST_F(MachineTest, TheWordMaxSetsNoLimit) {
  write("/proc/self/cgroup", "0::/a\n");
  write("/sys/fs/cgroup/a/memory.max", "max\n");
  write("/sys/fs/cgroup/a/cpu.max", "max 100000\n");
  EXPECT_FALSE(read().memory_bytes.has_value());
  EXPECT_FALSE(read().cores.has_value());
}

TEST_F(MachineTest, VersionOneIsReadFromEachControllersOwnTree) {
  write("/proc/self/cgroup", "4:memory:/jail\n2:cpu,cpuacct:/jail\n1:name=systemd:/\n");
  write("/sys/fs/cgroup/memory/jail/memory.limit_in_bytes", "1048576\n");
  write("/sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  write("/sys/fs/cgroup/cpu,cpuacct/jail/cpu.cfs_quota_us", "250000\n");
  write("/sys/fs/cgroup/cpu,cpuacct/jail/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(read().memory_bytes, 1048576u);
  EXPECT_EQ(read().cores, 3u);
}

TEST_F(MachineTest, AQuotaOfMinusOneSetsNoLimit) {
  write("/proc/self/cgroup", "2:cpu:/\n");
  write("/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1\n");
  write("/sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000\n");
  EXPECT_FALSE(read().cores.has_value());
}

TEST_F(MachineTest, AContainerThatSeesItsOwnGroupAsTheTopmostFindsItsLimits) {
  write("/proc/self/cgroup", "4:memory:/machine/abc\n2:cpu:/machine/abc\n0::/../outside\n");
  write("/sys/fs/cgroup/memory/memory.limit_in_bytes", "4096\n");
  write("/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "200000\n");
  write("/sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000\n");
  write("/sys/fs/cgroup/outside/memory.max", "1\n");
  EXPECT_EQ(read().memory_bytes, 4096u);
  EXPECT_EQ(read().cores, 2u);
}

TEST_F(MachineTest, TheUnifiedTreeOfAHybridSystemIsRead) {
  write("/proc/self/cgroup", "1:name=systemd:/\n0::/service\n");
  write("/sys/fs/cgroup/unified/service/memory.max", "8192\n");
  EXPECT_EQ(read().memory_bytes, 8192u);
}

TEST_F(MachineTest, UnreadableFilesSetNoLimit) {
  EXPECT_FALSE(read().cores.has_value());
  write("/proc/self/cgroup", "nonsense\n0::/a\n");
  write("/sys/fs/cgroup/a/memory.max", "lots\n");
  write("/sys/fs/cgroup/a/cpu.max", "100000\n");
  write("/sys/fs/cgroup/cpu.max", "0 0\n");
  EXPECT_FALSE(read().cores.has_value());
  EXPECT_FALSE(read().memory_bytes.has_value());
}

TEST_F(MachineTest, TheRealMachineHasCoresAndMemoryWithinTheAffinity) {
  cpu_set_t set;
  ASSERT_EQ(sched_getaffinity(0, sizeof set, &set), 0);
  const Machine machine = read_machine();
  EXPECT_GE(machine.cores, 1u);
  EXPECT_LE(machine.cores, static_cast<uint32_t>(CPU_COUNT(&set)));
  EXPECT_GT(machine.memory_bytes, uint64_t{1} << 20);
}

}  // namespace
}  // namespace locus::server
