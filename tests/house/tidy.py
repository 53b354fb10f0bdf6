"""Runs clang-tidy over the product's sources as a build folder compiles them: tidy.py BUILD [--jobs N] [--part PATH_PART].

With --part, checks only files whose path contains PATH_PART. Prints a line for each file, followed by its findings;
exits 1 if there is a finding. Leaves out the targets with planted bugs (mutation testing), because they compile the
same files. First checks a bad example, to detect a configuration that finds nothing.
"""
import argparse
import concurrent.futures
import json
import os
import re
import subprocess
import sys
import tempfile

ROOMS = ("core/", "server/", "client/", "deploy/")
BAD_EXAMPLE = "class Wrong_name {};\nint Function() { return 0; }\n"
FINDING = re.compile(r"(error|warning): ")


def tidy(folder, path):
    """Returns the findings of clang-tidy in a file; empty if there are none."""
    answer = subprocess.run(["clang-tidy", "--quiet", "-p", folder, path], capture_output=True, text=True)
    if FINDING.search(answer.stdout) or answer.returncode != 0:
        return answer.stdout or answer.stderr or f"clang-tidy exited with {answer.returncode}"
    return ""


def commands_of_the_product(build, root):
    with open(os.path.join(build, "compile_commands.json"), encoding="utf-8") as file:
        entries = json.load(file)
    return [entry for entry in entries if os.path.relpath(entry["file"], root).startswith(ROOMS)
            and "LOCUS_PLANT_BUGS" not in entry["command"]]


def sees_the_bad_example(folder, root):
    path = os.path.join(folder, "bad_example.cc")
    with open(path, "w", encoding="utf-8") as file:
        file.write(BAD_EXAMPLE)
    answer = subprocess.run(["clang-tidy", "--quiet", f"--config-file={root}/.clang-tidy", path, "--", "-std=c++20"],
                            capture_output=True, text=True)
    return answer.returncode != 0 and "Wrong_name" in answer.stdout and "Function" in answer.stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build")
    parser.add_argument("--part", default="", help="only files whose path has this part")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    options = parser.parse_args()
    root = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    entries = commands_of_the_product(options.build, root)
    paths = sorted({entry["file"] for entry in entries if options.part in entry["file"]})
    if not paths:
        print("tidy.py: there is nothing to check")
        return 1
    findings = 0
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        if not sees_the_bad_example(folder, root):
            print("tidy.py: clang-tidy does not see the bad example")
            return 1
        with open(os.path.join(folder, "compile_commands.json"), "w", encoding="utf-8") as file:
            json.dump(entries, file)
        said = pool.map(lambda path: tidy(folder, path), paths)
        for number, (path, text) in enumerate(zip(paths, said), 1):
            print(f"[{number}/{len(paths)}] {os.path.relpath(path, root)}{' FAILED' if text else ''}\n{text}", end="", flush=True)
            findings += bool(text)
    print(f"tidy.py: {len(paths) - findings} of {len(paths)} files are clean")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
