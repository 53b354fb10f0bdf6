"""Checks pages before the site is built, and fails the build:

    python3 check_pages.py --pages FOLDER

A block of code is run by a test or has a reason why not, a recipe is run and compared by a test, and the index of a section
links to every page in it.
"""
import argparse
import os
import sys

import blocks
import navigation


def read_pages(folder):
    """Returns the text of every page by its path from `folder`."""
    pages = {}
    for place, _, names in os.walk(folder):
        for name in names:
            if name.endswith(".md"):
                path = os.path.join(place, name)
                with open(path, encoding="utf-8") as file:
                    pages[os.path.relpath(path, folder)] = file.read()
    return pages


def faults_of_blocks(pages):
    return [f"{path}:{line}: {fault}" for path, text in sorted(pages.items()) for line, fault in blocks.faults_of(text)]


def recipes_without_a_test(pages):
    return [f"{path}: no test compares what this recipe prints" for path, text in sorted(pages.items())
            if path.startswith("cookbook/") and path != "cookbook/index.md" and not blocks.is_tested(text)]


def pages_without_a_link(pages):
    faults = []
    for path in sorted(pages):
        section = path.split("/")[0]
        index = section + "/index.md"
        if "/" not in path or path.endswith("/index.md"):
            continue
        group = os.path.dirname(path) + "/index.md"
        text = pages.get(index, "") + (pages.get(group, "") if group != index else "")
        targets = {os.path.normpath(os.path.join(os.path.dirname(page), target)) for page in {index, group}
                   for target in navigation.LINK.findall(pages.get(page, ""))}
        if path not in targets:
            faults.append(f"{path}: {index} has no link to it" if text else f"{index}: is missing")
    return sorted(set(faults))


def faults_of(pages):
    return faults_of_blocks(pages) + recipes_without_a_test(pages) + pages_without_a_link(pages)


def check(folder):
    """Prints the faults of the pages below a folder; returns the exit code."""
    faults = faults_of(read_pages(folder))
    print("".join(fault + "\n" for fault in faults), end="", file=sys.stderr)
    return 1 if faults else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pages", required=True)
    return check(parser.parse_args().pages)


if __name__ == "__main__":
    sys.exit(main())
