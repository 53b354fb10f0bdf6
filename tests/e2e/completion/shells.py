"""One class for each shell, with the completions that this shell offers at the end of a line. Runs the real shells."""

import os
import pty
import re
import subprocess
import tempfile
import time

SECONDS = 60


class Shell:
    def __init__(self, script, environment):
        self.script = script
        self.environment = environment

    def run(self, *command):
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=SECONDS, cwd=os.getcwd())
        if done.returncode != 0 or done.stderr:
            raise AssertionError(f"{command[0]} exited with {done.returncode} and said: {done.stderr}")
        return done.stdout

    def close(self):
        pass


class Bash(Shell):
    name = "bash"

    def check(self):
        return self.run("bash", "--norc", "-n", self.script)

    def offers(self, line):
        """Calls the completion function as readline does: readline splits words at = and : characters too."""
        words = re.findall(r"[=:]+|[^\s=:]+", line) + ([""] if line[-1] in " =:" else [])
        return self.run(
            "bash", "--norc", "-c",
            'source "$1"; COMP_LINE=$2; shift 2; COMP_POINT=${#COMP_LINE}; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1));'
            'f=$(complete -p locus); f=${f#*-F }; "${f%% *}" locus; printf "%s\\n" "${COMPREPLY[@]}"',
            "bash", self.script, line, *words).split()


class Fish(Shell):
    name = "fish"

    def check(self):
        return self.run("fish", "--no-config", "--no-execute", self.script)

    def offers(self, line):
        answer = self.run("fish", "--no-config", "-c", "source $argv[1]; complete --do-complete $argv[2]", self.script, line)
        return [offer.split("\t")[0].rstrip() for offer in answer.splitlines()]


class Zsh(Shell):
    """Runs zsh in a terminal, because completion needs the line editor: a bound key writes the matches to a file."""

    name = "zsh"
    SETUP = r"""
PS1= RPS1= LISTMAX=0
autoload -Uz compinit; compinit -D -u
source $SCRIPT
compadd() {
  local -a found
  if (( ! ${@[(I)-[OAD]*]} )); then builtin compadd -O found "$@"; print -rl -- $found >> $FOUND; fi
  builtin compadd "$@"
}
offers() { : > $FOUND; zle list-choices; print > $FOUND.done }
zle -N offers; bindkey '^T' offers
print > $FOUND.done
"""

    def __init__(self, script, environment):
        super().__init__(script, environment)
        self.folder = tempfile.TemporaryDirectory()
        self.found = os.path.join(self.folder.name, "found")
        self.terminal, other = pty.openpty()
        self.process = subprocess.Popen(["zsh", "-f", "-i"], stdin=other, stdout=other, stderr=other, start_new_session=True,
                                        env=dict(environment, SCRIPT=script, FOUND=self.found, TERM="vt100",
                                                 HOME=self.folder.name))
        os.close(other)
        os.set_blocking(self.terminal, False)
        setup = os.path.join(self.folder.name, "setup")
        with open(setup, "w", encoding="utf-8") as file:
            file.write(self.SETUP)
        self.type(f"source {setup}\n")

    def check(self):
        return self.run("zsh", "-f", "-n", self.script)

    def type(self, keys):
        """Types the text and waits until the shell reports that it is done."""
        said = b""
        os.write(self.terminal, keys.encode())
        deadline = time.monotonic() + SECONDS
        while not os.path.exists(self.found + ".done"):
            if time.monotonic() > deadline or self.process.poll() is not None:
                raise AssertionError(f"zsh does not answer; it said {said.decode(errors='replace')}")
            time.sleep(0.01)
            try:
                said += os.read(self.terminal, 65536)
            except BlockingIOError:
                pass
        os.remove(self.found + ".done")

    def offers(self, line):
        self.type("\x15" + line + "\x14")
        with open(self.found, encoding="utf-8") as file:
            return file.read().split()

    def close(self):
        self.process.kill()
        self.process.wait()
        os.close(self.terminal)
        self.folder.cleanup()
