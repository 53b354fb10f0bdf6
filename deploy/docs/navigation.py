"""Prints mkdocs' settings with the list of pages: the sections in a fixed order, and the pages of a section in the order in
which its index.md links to them.

    python3 navigation.py --settings mkdocs.yml --pages FOLDER --site FOLDER
"""
import argparse
import os
import re

import yaml

SECTIONS = ("start", "concepts", "tutorial", "cookbook", "reference", "performance", "operations", "promises")
LINK = re.compile(r"\]\(([^)#\s]+\.md)(?:#[^)]*)?\)")


def pages_in_order(folder, section):
    """Returns the pages below a section, as paths from `folder`: its index.md, the pages linked from there, and others."""
    top = os.path.join(folder, section)
    found = sorted(os.path.relpath(os.path.join(place, name), folder) for place, _, names in os.walk(top)
                   for name in names if name.endswith(".md"))
    index = os.path.join(section, "index.md")
    linked = []
    if index in found:
        with open(os.path.join(folder, index), encoding="utf-8") as file:
            linked = [os.path.normpath(os.path.join(section, target)) for target in LINK.findall(file.read())]
    order = [index, *linked]
    return sorted(found, key=lambda path: (order.index(path) if path in order else len(order), path))


def nested(section, paths):
    """Groups the pages of a folder inside the section under the folder's name."""
    items, groups = [], {}
    for path in paths:
        inside = os.path.relpath(path, section).split("/")
        if len(inside) == 1:
            items.append(path)
            continue
        if inside[0] not in groups:
            groups[inside[0]] = []
            items.append({inside[0].replace("_", " ").capitalize(): groups[inside[0]]})
        groups[inside[0]].append(path)
    for group in groups.values():
        group.sort(key=lambda path: not path.endswith("/index.md"))
    return items


def navigation(folder):
    """Returns the list of pages as mkdocs takes it."""
    sections = [name for name in SECTIONS if os.path.isdir(os.path.join(folder, name))]
    others = sorted(name for name in os.listdir(folder) if os.path.isdir(os.path.join(folder, name)) and name not in SECTIONS)
    top = sorted(name for name in os.listdir(folder) if name.endswith(".md") and name != "index.md")
    return ["index.md", *top] + [{name.capitalize(): nested(name, pages_in_order(folder, name))} for name in sections + others
                                 if pages_in_order(folder, name)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--settings", required=True)
    parser.add_argument("--pages", required=True)
    parser.add_argument("--site", required=True)
    options = parser.parse_args()
    with open(options.settings, encoding="utf-8") as file:
        settings = yaml.safe_load(file)
    settings.update(docs_dir=options.pages, site_dir=options.site, nav=navigation(options.pages))
    print(yaml.safe_dump(settings, sort_keys=False, allow_unicode=True))


if __name__ == "__main__":
    main()
