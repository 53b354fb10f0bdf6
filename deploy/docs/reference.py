"""Writes the generated pages of the reference:

    python3 reference.py --source TOP --build DIR --pages FOLDER

The protocol comes from its descriptor set, commands and options from the parsers of the programs, defaults from
`locusd config`, and metrics from a running locusd.
"""
import argparse
import os
import subprocess

import markdown
import operation_pages
import protocol


def title_and_summary(text):
    """Returns the title of a command's page and the first sentence of its description."""
    title = text.split("\n", 1)[0].removeprefix("# ")
    description = text.split("\n## Description\n\n", 1)[1].split("\n\n", 1)[0].replace("\n", " ")
    return title, description.split(". ")[0].rstrip(".") + "."


def write_commands(binaries, folder):
    """Writes a page for each command, and their index."""
    os.makedirs(folder, exist_ok=True)
    subprocess.run([os.path.join(binaries, "write_manual"), "--markdown", folder], check=True, timeout=60)
    rows = {"locus": [], "locusd": []}
    for name in sorted(os.listdir(folder)):
        title, summary = title_and_summary(operation_pages.read(folder, name))
        rows[title.split(" ")[0]].append([f"[{title}]({name})", summary])
    text = ("# Commands and options\n\nThese pages are made from the parsers of the programs, like their manual pages "
            "(`man locus-query-ray`) and `--help`.\n")
    for program, lines in rows.items():
        text += f"\n## {program}\n\n" + markdown.table(["command", "what it does"], lines)
    write(folder, "index.md", text)


def write(folder, name, text):
    with open(os.path.join(folder, name), "w", encoding="utf-8") as file:
        file.write(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--source", required=True)
    parser.add_argument("--build", required=True)
    parser.add_argument("--pages", required=True)
    options = parser.parse_args()
    binaries = os.path.join(options.build, "bin")
    os.makedirs(options.pages, exist_ok=True)
    pages = protocol.write_pages(options.source, os.path.join(options.pages, "protocol"))
    write_commands(binaries, os.path.join(options.pages, "commands"))
    write(options.pages, "configuration.md", operation_pages.configuration(options.source, binaries))
    write(options.pages, "metrics.md", operation_pages.metrics(options.source, binaries))
    write(options.pages, "errors.md", operation_pages.errors(options.source, pages))


if __name__ == "__main__":
    main()
