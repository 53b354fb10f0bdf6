"""Gaps in the reference of the built site. Each function gets the pages (site_pages.py) and the truth from a program, and
returns what is missing or wrong.
"""
import os
import re

from site_pages import letters

HELP_OPTION = re.compile(r"^  (-[^ ]+)", re.MULTILINE)
HELP_SECTION = re.compile(r"^(Subcommands|Commands):\n((?:  .*\n?)+)", re.MULTILINE)


def missing_elements(pages, elements):
    """Checks that each element of the protocol has a place of its own, with its whole comment."""
    faults = []
    for element in elements:
        path = "reference/protocol/" + os.path.basename(element.file).replace(".proto", ".html")
        place = pages[path].by_id.get(element.name) if path in pages else None
        if place is None:
            faults.append(f"{element.name}: is not in {path}")
        elif not element.comment.strip():
            faults.append(f"{element.name}: has no comment")
        elif letters(element.comment) not in letters(place):
            faults.append(f"{element.name}: its comment is not in {path}, but: {place[:200]}")
    return faults


def options_of_help(text):
    """Returns the names of the options in a help text."""
    return [name for names in HELP_OPTION.findall(text) for name in names.split(",")]


def missing_options(pages, helps):
    """Checks that each command has a page with all its options. `helps` are help texts by command."""
    faults = []
    for command, text in helps.items():
        path = f"reference/commands/{command.replace(' ', '-')}.html"
        if path not in pages:
            faults.append(f"{command}: has no page {path}")
            continue
        faults += [f"{command}: {name} is not in {path}" for name in options_of_help(text)
                   if not re.search(rf"(?<![\w-]){re.escape(name)}(?![\w-])", pages[path].text)]
    return faults


def missing_settings(pages, defaults):
    """Checks that each option of locusd's file is in the page of the configuration with its default."""
    page = pages["reference/configuration.html"]
    faults = []
    for name, value in defaults.items():
        place = page.by_id.get(name)
        if place is None:
            faults.append(f"{name}: is not in the page of the configuration")
        elif (value or "empty") not in place.split():
            faults.append(f"{name}: its default {value or 'empty'} is not shown, but: {place.split()}")
    return faults


def missing_metrics(pages, families):
    """Checks that each metric of a running daemon is in the page with its type, help and labels. `families` has
    (name, type, help, labels). The page may have others if it says that only a member of a cluster has them.
    """
    page = pages["reference/metrics.html"]
    faults = []
    for name, kind, text, labels in families:
        place = page.by_id.get(name)
        if place is None:
            faults.append(f"{name}: is not in the page of metrics")
            continue
        faults += [f"{name}: {word} is not shown" for word in (kind, *sorted(labels - {"le"}))
                   if not re.search(rf"\b{word}\b", place)]
        faults += [f"{name}: its help is not shown"] if letters(text) not in letters(place) else []
    known = {name for name, *_ in families}
    return faults + [f"{name}: is not a metric of locusd" for name in sorted(page.by_id)
                     if re.match(r"(locus|process)_", name) and name not in known and "In a cluster: " not in page.by_id[name]]


def missing_reasons(pages, reasons):
    """Checks that each Reason has a section that says what it means and what to do. `reasons` are comments by name."""
    page = pages["reference/errors.html"]
    faults = []
    for name, comment in reasons.items():
        place = page.by_id.get(name.removeprefix("REASON_").lower())
        if place is None:
            faults.append(f"{name}: has no section in the page of errors")
        elif letters(comment) not in letters(place):
            faults.append(f"{name}: the section does not say what it means")
        elif not re.search(r"What to do\.\s+\S+ \S+ \S+", place):
            faults.append(f"{name}: the section does not say what to do")
    return faults


def missing_runbooks(pages, alerts):
    """Checks that each alert links to a section of the runbook that exists. `alerts` are annotations by name."""
    faults = []
    for name, annotations in alerts.items():
        found = re.search(r"([\w/-]+\.(?:html|md))#([\w-]+)$", annotations.get("runbook_url", ""))
        if not found:
            faults.append(f"{name}: has no runbook_url that ends in a page and a section")
            continue
        ends = [path for path in pages if found.group(1).replace(".md", ".html").endswith(path)]
        if not any(found.group(2) in pages[path].ids for path in ends):
            faults.append(f"{name}: {found.group(0)} is no section of the site")
    return faults
