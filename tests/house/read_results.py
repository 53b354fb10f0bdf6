"""Prints one line for each test of a JUnit file written by ctest: its outcome (passed, failed, skipped) and its name.

ctest reports a test as "not run" if its program is missing, if its fixture failed, or if it skipped itself; this
program counts only the last case as skipped. A test that Python's unittest skipped gets its own line,
because the ctest test that contains it can pass nevertheless. For the same reason, an attack (see tests/attack) gets
its own line if some or all of its steps were skipped.

With --failures, prints the end of the output of each failed test instead.
"""
import re
import sys
import xml.etree.ElementTree as ElementTree

FAILURE_LINES = 20


def outcome(case):
    status = case.get("status")
    if status == "run":
        return "passed"
    reason = case.find("skipped")
    skipped_itself = status == "notrun" and reason is not None and reason.get("message", "").startswith("SKIP_")
    return "skipped" if skipped_itself or status == "disabled" else "failed"


def skipped_within(case):
    return re.findall(r"^(\w+) \(.*\) \.\.\. skipped ", case.findtext("system-out") or "", re.MULTILINE)


def left_out(case):
    output = case.findtext("system-out") or ""
    return re.findall(r"^skipped: ([\w-]+): not survived yet", output, re.MULTILINE) + \
        [f"{name}: {what}" for name, what in re.findall(r"^\d+MiB ([\w-]+): skipped: (.*)$", output, re.MULTILINE)]


def print_failures(path):
    for case in ElementTree.parse(path).getroot().iter("testcase"):
        if outcome(case) == "failed":
            print(f"---- {case.get('name')}, the end of its output:")
            print(*(case.findtext("system-out") or "").splitlines()[-FAILURE_LINES:], sep="\n")


def main(path):
    for case in ElementTree.parse(path).getroot().iter("testcase"):
        print(outcome(case), case.get("name"))
        for name in skipped_within(case):
            print("skipped", case.get("name") + "." + name)
        for name in left_out(case):
            print("skipped", case.get("name") + "." + name)


if __name__ == "__main__":
    if sys.argv[1] == "--failures":
        print_failures(sys.argv[2])
    else:
        main(sys.argv[1])
