"""Puts the content of files in place of the lines of pages that name them (see blocks.py), for the build of the site:

    python3 include_files.py --pages FOLDER
"""
import argparse
import os

import blocks


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pages", required=True)
    for place, _, names in os.walk(parser.parse_args().pages):
        for path in (os.path.join(place, name) for name in names if name.endswith(".md")):
            with open(path, encoding="utf-8") as file:
                text = file.read()
            if blocks.INCLUDE.search(text):
                with open(path, "w", encoding="utf-8") as file:
                    file.write(blocks.included(text))


if __name__ == "__main__":
    main()
