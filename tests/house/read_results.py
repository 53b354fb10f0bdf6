"""Prints one line a test of a JUnit file written by ctest: its outcome (passed, failed, skipped) and its name.

ctest files a test whose program is missing, or whose fixture failed, under "not run", like one that skipped itself. Here
only the second kind is a skip. What Python's unittest skipped within a test that passed gets a line, too.
"""
import re
import sys
import xml.etree.ElementTree as ElementTree


def outcome(case):
    status = case.get("status")
    if status == "run":
        return "passed"
    reason = case.find("skipped")
    skipped_itself = status == "notrun" and reason is not None and reason.get("message", "").startswith("SKIP_")
    return "skipped" if skipped_itself or status == "disabled" else "failed"


def skipped_within(case):
    return re.findall(r"^(\w+) \(.*\) \.\.\. skipped ", case.findtext("system-out") or "", re.MULTILINE)


def main(path):
    for case in ElementTree.parse(path).getroot().iter("testcase"):
        print(outcome(case), case.get("name"))
        for name in skipped_within(case):
            print("skipped", case.get("name") + "." + name)


if __name__ == "__main__":
    main(sys.argv[1])
