// A program that runs in a process of its own. The destructor kills the process.
#ifndef LOCUS_TESTS_SUPPORT_CHILD_PROCESS_H_
#define LOCUS_TESTS_SUPPORT_CHILD_PROCESS_H_

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>
#include <vector>

namespace locus::test {

class ChildProcess {
 public:
  // Starts the program. Its standard output and standard error go to the file `log`.
  ChildProcess(const std::string& program, std::vector<std::string> arguments, const std::string& log) {
    arguments.insert(arguments.begin(), program);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    EXPECT_EQ(access(program.c_str(), X_OK), 0) << program;
    pid_ = fork();
    if (pid_ == 0) become(argv, log);
    EXPECT_GT(pid_, 0) << "cannot start " << program;
  }
  ~ChildProcess() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    wait();
  }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }
  void signal(int number) { kill(pid_, number); }

  // Waits for the end of the process and returns its exit code; -1 if a signal ended it.
  int wait() {
    int status = 0;
    if (pid_ <= 0 || waitpid(pid_, &status, 0) != pid_) return -1;
    pid_ = 0;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  // Replaces the forked process by the program. This function must not allocate memory or lock, since only
  // async-signal-safe calls are allowed between fork() and exec(). The kernel kills the program if the test is killed.
  [[noreturn]] static void become(const std::vector<char*>& argv, const std::string& log) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    dup2(file, STDOUT_FILENO);
    dup2(file, STDERR_FILENO);
    execv(argv.front(), argv.data());
    _exit(127);
  }

  pid_t pid_ = 0;
};

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_CHILD_PROCESS_H_
