#include "tests/bench/serving/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace locus::bench::serving {
namespace {

constexpr double kFarewell = 5;
constexpr double kPatience = 0.005;
constexpr int kNoProgram = 127;

std::string folder_of(pid_t pid) { return absl::StrCat("/proc/", pid); }

int64_t entries_in(const std::string& folder) {
  std::error_code ignored;
  int64_t entries = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
    entries += entry.path().empty() ? 0 : 1;
  return entries;
}

// Executes the program in the child after fork(). Makes only system calls, since another thread may have held a lock at
// fork(). If the parent, `parent`, died before prctl() took effect, ends the child.
[[noreturn]] void become(const char* path, char* const* arguments, int log, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kNoProgram);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(path, arguments);
  _exit(kNoProgram);
}

}  // namespace

void sleep_seconds(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

absl::StatusOr<std::unique_ptr<Process>> Process::start(const std::string& path,
                                                        const std::vector<std::string>& arguments,
                                                        const std::string& log) {
  if (access(path.c_str(), X_OK) != 0) return absl::UnavailableError(absl::StrCat("there is no program ", path));
  std::vector<std::string> owned = arguments;
  std::vector<char*> words;
  for (std::string& word : owned) words.push_back(word.data());
  words.push_back(nullptr);
  const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (file < 0) return absl::UnavailableError(absl::StrCat("cannot write ", log));
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0) become(path.c_str(), words.data(), file, parent);
  close(file);
  if (pid < 0) return absl::UnavailableError(absl::StrCat("cannot start ", path));
  return std::unique_ptr<Process>(new Process(pid));
}

bool Process::has_ended() {
  int status = 0;
  if (ended_ || waitpid(pid_, &status, WNOHANG) != pid_) return ended_;
  if (WIFEXITED(status)) exit_code_ = WEXITSTATUS(status);
  return ended_ = true;
}

Process::~Process() {
  if (has_ended()) return;
  kill(pid_, SIGTERM);
  for (double waited = 0; waited < kFarewell && !has_ended(); waited += kPatience) sleep_seconds(kPatience);
  if (ended_) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

double cpu_seconds_of(pid_t pid) {
  clockid_t clock{};
  timespec computed{};
  if (clock_getcpuclockid(pid, &clock) != 0 || clock_gettime(clock, &computed) != 0) return 0;
  return static_cast<double>(computed.tv_sec) + 1e-9 * static_cast<double>(computed.tv_nsec);
}

int64_t Process::resident_bytes() const {
  std::ifstream file(folder_of(pid_) + "/statm");
  int64_t size = 0, resident = 0;
  file >> size >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

int64_t Process::open_files() const { return entries_in(folder_of(pid_) + "/fd"); }
int64_t Process::threads() const { return entries_in(folder_of(pid_) + "/task"); }

std::string text_of_file(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

std::string program_beside(const std::string& name) {
  std::error_code error;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string path = (own.parent_path() / name).string();
  return !error && access(path.c_str(), X_OK) == 0 ? path : "";
}

std::string program_in_path(const std::string& name) {
  const char* const folders = std::getenv("PATH");
  for (const absl::string_view folder : absl::StrSplit(folders == nullptr ? "" : folders, ':')) {
    const std::string path = absl::StrCat(folder, "/", name);
    if (access(path.c_str(), X_OK) == 0) return path;
  }
  return "";
}

}  // namespace locus::bench::serving
