#include "server/observability/process_figures.h"

#include <dirent.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <memory>
#include <set>

#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "server/config/listen_address.h"

namespace locus::server {
namespace {

// Addresses whose connections are counted: local TCP ports and paths of unix sockets.
struct Ends {
  std::set<uint16_t> ports;
  std::set<std::string> paths;
};

Ends ends_of(const std::vector<std::string>& addresses) {
  Ends ends;
  for (const std::string& text : addresses) {
    const absl::StatusOr<ListenAddress> address = parse_listen_address(text);
    if (!address.ok()) continue;
    if (address->kind == ListenAddress::Kind::kTcp) {
      ends.ports.insert(address->port);
    } else {
      ends.paths.insert(address->path);
    }
  }
  return ends;
}

// Returns whether `fd` is a connected socket whose local address is in `ends`. Listening sockets are not counted.
bool is_connection(int fd, const Ends& ends) {
  sockaddr_storage name{};
  socklen_t length = sizeof name;
  if (getsockname(fd, reinterpret_cast<sockaddr*>(&name), &length) != 0) return false;
  bool ours = false;
  if (name.ss_family == AF_INET) ours = ends.ports.contains(ntohs(reinterpret_cast<const sockaddr_in&>(name).sin_port));
  if (name.ss_family == AF_INET6)
    ours = ends.ports.contains(ntohs(reinterpret_cast<const sockaddr_in6&>(name).sin6_port));
  if (name.ss_family == AF_UNIX) {
    const auto& local = reinterpret_cast<const sockaddr_un&>(name);
    ours = ends.paths.contains(std::string(local.sun_path, strnlen(local.sun_path, sizeof local.sun_path)));
  }
  sockaddr_storage peer{};
  socklen_t peer_length = sizeof peer;
  return ours && getpeername(fd, reinterpret_cast<sockaddr*>(&peer), &peer_length) == 0;
}

void count_files(const Ends& ends, ProcessFigures& process) {
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(opendir("/proc/self/fd"), closedir);
  if (folder == nullptr) return;
  std::set<ino_t> connections;  // a connection may have several descriptors, but only one inode
  while (const dirent* entry = readdir(folder.get())) {
    int fd = 0;
    if (!absl::SimpleAtoi(entry->d_name, &fd) || fd == dirfd(folder.get())) continue;
    ++process.open_files;
    struct stat file {};
    if (is_connection(fd, ends) && fstat(fd, &file) == 0) connections.insert(file.st_ino);
  }
  process.connections = connections.size();
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) * 1e-6;
}

// Returns the fields of /proc/self/stat after the process's name. The name may contain spaces and brackets, so the
// fields begin after the last bracket of the line.
std::vector<std::string> fields_after_name() {
  std::string line;
  std::getline(std::ifstream("/proc/self/stat"), line);
  const size_t end = line.rfind(") ");
  if (end == std::string::npos) return {};
  return absl::StrSplit(line.substr(end + 2), ' ');
}

// Returns the time of the machine's start, in seconds since 1970.
double boot_seconds() {
  timespec since_boot{};
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &since_boot);
  clock_gettime(CLOCK_REALTIME, &now);
  return static_cast<double>(now.tv_sec - since_boot.tv_sec) +
         static_cast<double>(now.tv_nsec - since_boot.tv_nsec) * 1e-9;
}

double number_at(const std::vector<std::string>& fields, size_t at) {
  double value = 0;
  return at < fields.size() && absl::SimpleAtod(fields[at], &value) ? value : 0;
}

}  // namespace

uint64_t resident_bytes() {
  // Sizes in pages: `mapped` is the size of the whole address space, `resident` of the part that is in memory.
  uint64_t mapped = 0;
  uint64_t resident = 0;
  std::ifstream("/proc/self/statm") >> mapped >> resident;
  return resident * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

ProcessFigures read_process(const std::vector<std::string>& addresses) {
  // Indices into fields_after_name(), whose first field is field 3 in proc(5).
  constexpr size_t kThreads = 17;
  constexpr size_t kStart = 19;
  ProcessFigures process;
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) == 0) process.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) == 0) process.max_files = files.rlim_cur;
  const std::vector<std::string> fields = fields_after_name();
  process.threads = static_cast<uint64_t>(number_at(fields, kThreads));
  process.start_seconds = boot_seconds() + number_at(fields, kStart) / static_cast<double>(sysconf(_SC_CLK_TCK));
  process.resident_bytes = resident_bytes();
  count_files(ends_of(addresses), process);
  return process;
}

void add_process_figures(const ProcessFigures& process, MetricPage& page) {
  page.add_one("locus_connections_open", "Open gRPC connections.", MetricKind::kGauge,
               static_cast<double>(process.connections));
  page.add_one("process_cpu_seconds_total", "Processor time used, user and system, in seconds.", MetricKind::kCounter,
               process.cpu_seconds);
  page.add_one("process_resident_memory_bytes", "Memory held, in bytes.", MetricKind::kGauge,
               static_cast<double>(process.resident_bytes));
  page.add_one("process_threads", "Threads.", MetricKind::kGauge, static_cast<double>(process.threads));
  page.add_one("process_open_fds", "Open file descriptors.", MetricKind::kGauge,
               static_cast<double>(process.open_files));
  page.add_one("process_max_fds", "File descriptors that may be open.", MetricKind::kGauge,
               static_cast<double>(process.max_files));
  page.add_one("process_start_time_seconds", "When the process started, in seconds since 1970.", MetricKind::kGauge,
               process.start_seconds);
}

}  // namespace locus::server
