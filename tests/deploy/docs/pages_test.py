"""Runs every block of code in pages of the documentation and compares what it prints with what the page shows:

    python3 pages_test.py --pages FOLDER --build DIR [--jobs N] [PAGE|SECTION]...

Each page gets a fresh locusd, a folder, and one shell. Commands in console blocks print what is shown below them; the text
block directly after a script shows what the script prints. EPOCH stands for a scene's random epoch, and `...` for any text.
The marks that a page may put above a block are listed in deploy/docs/blocks.py.
"""
import argparse
import concurrent.futures
import fcntl
import json
import os
import re
import shlex
import subprocess
import sys
import time
import traceback

import yaml

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "../../../deploy/docs")]
sys.dont_write_bytecode = True
import blocks  # noqa: E402
import page_shell  # noqa: E402

SCRIPTS = {"sh": "{}", "bash": "{}", "python": "/usr/bin/python3 -B {}", "lua": "locus run {}"}
COMPILE = "g++ -std=c++20 {0} -o {0}.bin $(pkg-config --cflags --libs locus-client) && ./{0}.bin"


def masked(text):
    text = re.sub(r'(epoch"?[:\s]+"?)\d+', r"\1EPOCH", text)
    return "\n".join(line.rstrip() for line in text.strip().splitlines())


def agrees(shown, printed):
    """Returns whether the printed text is what the page shows. A line `...` stands for any number of lines, also none, and
    `...` inside a line for any text.
    """
    parts = []
    for line in masked(shown).split("\n"):
        whole = line.strip() == "..."
        parts.append(r"(?:[^\n]*\n)*?" if whole else r"[^\n]*?".join(map(re.escape, line.split("..."))) + "\n")
    return re.fullmatch("".join(parts), masked(printed) + "\n") is not None


class Page:
    """Runs the blocks of one page in order and collects the faults."""

    def __init__(self, path, shell):
        self.path, self.shell, self.faults, self.ran = path, shell, [], 0

    def fault(self, block, message):
        self.faults.append(f"{self.path}:{block.line}: {message}")

    def run_command(self, block, command, shown, wanted_code):
        code, output, errors = self.shell.run(command)
        printed = output + errors if wanted_code else output
        if code != wanted_code:
            self.fault(block, f"exits with {code}, not {wanted_code}: {command}\n{output}{errors}")
        elif shown is not None and not agrees(shown, printed):
            self.fault(block, f"prints something else: {command}\n-- shown:\n{masked(shown)}\n-- printed:\n{masked(printed)}\n"
                              f"-- errors:\n{errors}")

    def run_console(self, block):
        commands = blocks.commands_of(block)
        for number, (command, shown) in enumerate(commands, 1):
            last = number == len(commands)
            self.run_command(block, command, shown, int(block.marks.get("fails", 0)) if last else 0)

    def run_script(self, block, shown):
        wanted_code = int(block.marks.get("fails", 0))
        if block.language in ("sh", "bash"):
            return self.run_command(block, block.text, shown, wanted_code)
        if block.language == "grpcurl":
            return self.run_call(block)
        name = f"block_{block.line}." + {"python": "py", "cpp": "cc", "lua": "lua"}[block.language]
        self.shell.write(name, block.text)
        command = COMPILE.format(name) if block.language == "cpp" else SCRIPTS[block.language].format(name)
        return self.run_command(block, f'(cd "{self.shell.folder}" && {command})', shown, wanted_code)

    def run_call(self, block):
        """Makes the call of grpcurl with `locus call`, because Debian does not package grpcurl."""
        for command, shown in blocks.commands_of(block):
            words = shlex.split(command)
            if words[:3] != ["grpcurl", "-plaintext", "-d"] or words[4] != page_shell.SHOWN_ADDRESS:
                self.fault(block, f"is no call that the test can make: {command}")
            else:
                self.run_command(block, shlex.join(["locus", "call", words[5], words[3]]), shown, 0)

    def run(self):
        with open(self.path, encoding="utf-8") as file:
            text = file.read()
        self.faults += [f"{self.path}:{line}: {fault}" for line, fault in blocks.faults_of(text)]
        found = blocks.blocks_of(text)
        for block, after in zip(found, [*found[1:], None]):
            if "file" in block.marks:
                self.shell.write(block.marks["file"], block.text)
            if not block.is_run:
                self.check_data(block)
                continue
            self.ran += 1
            shown = after.text if after and after.follows and after.language == "text" else None
            if block.language == "console":
                self.run_console(block)
            else:
                self.run_script(block, shown)

    def check_data(self, block):
        """Reads blocks of data that are not run: they must at least be well formed."""
        if "not run" in block.marks:
            return
        try:
            if block.language == "json":
                json.loads(block.text)
            elif block.language == "yaml":
                list(yaml.safe_load_all(block.text))
        except ValueError as error:
            self.fault(block, f"is no JSON: {error}")
        except yaml.YAMLError as error:
            self.fault(block, f"is no YAML: {error}")


def needs_library(text):
    return any(block.is_run and (block.language == "cpp" or "pkg-config" in block.text or "cmake" in block.text)
               for block in blocks.blocks_of(text))


def installed_library(build):
    """Installs the C++ library into the build folder, as its package does, and returns the prefix."""
    prefix = os.path.join(build, "deploy/docs/prefix")
    os.makedirs(prefix, exist_ok=True)
    with open(os.path.join(build, "deploy/docs/prefix.lock"), "w", encoding="utf-8") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        subprocess.run(["cmake", "--install", build, "--prefix", prefix, "--component", "dev"], check=True,
                       stdout=subprocess.DEVNULL, timeout=120)
    return prefix


def run_page(path, options):
    """Returns the number of blocks that were run, and the faults."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    if not any(block.is_run for block in blocks.blocks_of(text)):
        return 0, [f"{path}:{line}: {fault}" for line, fault in blocks.faults_of(text)]
    prefix = installed_library(options.build) if needs_library(text) else None
    try:
        with page_shell.PageShell(os.path.join(options.build, "bin"), os.path.join(options.build, "python"),
                                  blocks.daemon_options(text), prefix) as shell:
            page = Page(path, shell)
            page.run()
    except (RuntimeError, OSError, subprocess.SubprocessError) as error:
        return 0, [f"{path}: {error}\n{traceback.format_exc()}"]
    return page.ran, page.faults


def pages_below(folder, names):
    found = sorted(os.path.join(place, name) for place, _, files in os.walk(folder) for name in files if name.endswith(".md"))
    chosen = [os.path.normpath(os.path.join(folder, name)) for name in names]
    return [path for path in found if not chosen or any(path == one or path.startswith(one + "/") for one in chosen)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pages", required=True)
    parser.add_argument("--build", required=True)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("names", nargs="*", metavar="PAGE|SECTION")
    options = parser.parse_args()
    options.build = os.path.abspath(options.build)
    pages = pages_below(options.pages, options.names)
    if not pages:
        print(f"no page below {options.pages} has such a name")
        return 1
    failed = 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        started = {pool.submit(run_page, path, options): (path, time.monotonic()) for path in pages}
        for future in concurrent.futures.as_completed(started):
            path, begin = started[future]
            ran, faults = future.result()
            print(f"{'FAILED' if faults else 'ok':6} {path}: {ran} blocks run, after {time.monotonic() - begin:.1f} s")
            print("".join(fault + "\n" for fault in faults), end="", flush=True)
            failed += bool(faults)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
