// Runs a program to its end, with standard error on a pseudo terminal or on a pipe, and with standard output in a file.
#ifndef LOCUS_TESTS_SUPPORT_TERMINAL_RUN_H_
#define LOCUS_TESTS_SUPPORT_TERMINAL_RUN_H_

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "tests/support/built_program.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/text_of.h"

namespace locus::test {

enum class ErrorTo { kTerminal, kPipe };

struct ProgramRun {
  int exit_code = -1;
  std::string out;
  std::string err;
};

// Runs the program `name` of this build. A terminal turns each line end of `err` into "\r\n".
inline ProgramRun run_program(const std::string& name, std::vector<std::string> arguments, ErrorTo error_to) {
  const TemporaryFolder folder;
  const std::string program = built_program(name);
  const std::string out_path = folder.file("out");
  arguments.insert(arguments.begin(), program);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  int ends[2] = {-1, -1};  // read end and write end
  winsize size{};
  size.ws_row = 24;
  size.ws_col = 200;
  const int opened = error_to == ErrorTo::kPipe ? pipe(ends) : openpty(&ends[0], &ends[1], nullptr, nullptr, &size);
  EXPECT_EQ(opened, 0);
  const pid_t pid = fork();
  if (pid == 0) {
    dup2(open(out_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
    dup2(ends[1], STDERR_FILENO);
    close(ends[0]);
    close(ends[1]);
    execv(argv.front(), argv.data());
    _exit(127);
  }
  close(ends[1]);
  ProgramRun run;
  char buffer[4096];
  // At the end of the program, read() returns 0 for a pipe and the error EIO for a terminal.
  for (ssize_t count = 0; (count = read(ends[0], buffer, sizeof buffer)) > 0;)
    run.err.append(buffer, static_cast<size_t>(count));
  close(ends[0]);
  int status = 0;
  EXPECT_EQ(waitpid(pid, &status, 0), pid);
  if (WIFEXITED(status)) run.exit_code = WEXITSTATUS(status);
  run.out = text_of(out_path);
  return run;
}

}  // namespace locus::test

#endif  // LOCUS_TESTS_SUPPORT_TERMINAL_RUN_H_
