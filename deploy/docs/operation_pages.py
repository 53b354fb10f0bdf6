"""Pages of the reference for operators: configuration, metrics and errors."""
import json
import os
import re
import subprocess

import yaml
from prometheus_client.parser import text_string_to_metric_families

import daemon
import markdown

OPTION = re.compile(r"#([a-z0-9-]+) = (.*)")


def read(*path):
    with open(os.path.join(*path), encoding="utf-8") as file:
        return file.read()


def paragraphs_of_example(text):
    """Returns pairs of a comment and the names of the options below it, of locusd.conf.example."""
    found = []
    for paragraph in text.split("\n\n")[1:]:
        comment, names = [], []
        for line in paragraph.split("\n"):
            option = OPTION.fullmatch(line)
            if option and option.group(1) not in names:
                names.append(option.group(1))
            elif line.startswith("# "):
                comment.append(line[2:])
        found.append((comment, names))
    return found


def effective_options(binaries):
    """Returns the options that `locusd config` lists, with the values that they have without any setting."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("LOCUS_")}
    done = subprocess.run([os.path.join(binaries, "locusd"), "config", "--json"], env=environment, capture_output=True,
                          text=True, check=True, timeout=60)
    return {row["option"]: row["value"] for row in json.loads(done.stdout)["options"]}


# Options whose effective value depends on the machine, with the value that stands for it.
OF_THE_MACHINE = {"threads": "0", "memory-limit": "0"}


def configuration(source, binaries):
    """Returns the page of options of the daemon's file: comments of the example, and the defaults of the program."""
    defaults = effective_options(binaries)
    text = ("# Configuration of locusd\n\n"
            "An option is set by a flag (`--max-scenes 10`), an environment variable (`LOCUS_MAX_SCENES=10`) or a line of the "
            "file that `--config FILE` names (`max-scenes = 10`). The first of the three that is set wins. In the file, `#` "
            "begins a comment. `locusd config` prints the value of every option and where it comes from; the "
            "flags are also listed with [locusd](commands/locusd.md). Changes take effect at the next start, except that the "
            "contents of the files of certificates, tokens, keys and access rules are read again when they change.\n")
    for comment, names in paragraphs_of_example(read(source, "deploy/locusd.conf.example")):
        rows = [[f"[`{name}`](#{name}){{#{name}}}", value_cell(OF_THE_MACHINE.get(name, defaults[name])),
                 f"`LOCUS_{name.upper().replace('-', '_')}`"] for name in names]
        text += "\n## " + ", ".join(names) + "\n\n" + markdown.markdown_of("\n".join(comment)) + "\n"
        text += markdown.table(["option", "default", "variable"], rows)
    return text


def value_cell(value):
    return f"`{value}`" if value else "empty"


def labels_by_metric(readme):
    """Returns labels, unit and meaning of each metric, from the table of deploy/dashboards/README.md. A name that begins
    with an underscore goes on after locus_scene.
    """
    found = {}
    for line in readme.split("\n"):
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        for name in re.findall(r"`([\w*]+)`", cells[0]) if line.startswith("| `") and len(cells) == 4 else ():
            found["locus_scene" + name if name.startswith("_") else name] = (cells[1], cells[2], cells[3])
    return found


def family_name(family):
    """Returns the name as it is scraped: counters end with _total."""
    return family.name + ("_total" if family.type == "counter" else "")


def cluster_metrics(known):
    """Returns name, type and meaning of the metrics that a daemon without a cluster, such as that of this page, lacks."""
    for name, (_, unit, meaning) in known.items():
        if meaning.startswith("in a cluster: "):
            kind = "histogram" if "histogram" in unit else "counter" if name.endswith("_total") else "gauge"
            yield name, kind, meaning[0].upper() + meaning[1:] + "."


def metrics(source, binaries):
    """Returns the page of metrics, with names, types and help of a running daemon."""
    known = labels_by_metric(read(source, "deploy/dashboards/README.md"))
    with daemon.Daemon(binaries) as running:
        families = list(text_string_to_metric_families(running.metrics()))
    shown = [(family_name(family), family.type, family.documentation) for family in families]
    shown += cluster_metrics(known)
    text = ("# Metrics\n\n"
            "locusd serves them on `/metrics` of its HTTP port (127.0.0.1:7576 by default) in the text format of Prometheus. The "
            "first 100 scenes have a label of their own, and the others are summed as `_other`. A histogram has the series "
            "`_bucket`, `_sum` and `_count`. Only a member of a cluster has the metrics whose text begins with *in a "
            "cluster*.\n")
    for name, kind, meaning in sorted(shown):
        labels, unit, _ = known.get(name, known["process_*"] if name.startswith("process_") else ("", "", ""))
        facts = [kind, "labels " + ", ".join(f"`{label}`" for label in labels.split(", ")) if labels else "no labels"]
        of_one = not unit or unit.startswith(("0", "1")) or name.startswith("process_")
        facts += [] if of_one else ["unit: " + unit.replace(", histogram", "")]
        term = f"[`{name}`](#{name}){{#{name}}} {', '.join(facts)}"
        text += markdown.definition(term, markdown.markdown_of(meaning))
    return text


def calls_with_reason(pages, reason):
    """Returns links to the calls whose comments name a reason."""
    return [pages.link(element.name) for element in pages.by_name.values()
            if element.kind == "rpc" and re.search(rf"\b{reason}\b", element.comment)]


def errors(source, pages):
    """Returns the page of errors: every Reason of the protocol with its meaning and what to do about it."""
    remedies = yaml.safe_load(read(source, "deploy/docs/remedies.yml"))
    reasons = {part.descriptor.name: part for part in pages.by_name["Reason"].parts}
    missing = [name for name in reasons if name.removeprefix("REASON_") not in remedies]
    if missing:
        raise SystemExit(f"remedies.yml: has nothing about {', '.join(missing)}")
    # Links of the comments are relative to the pages of the protocol.
    def moved(text):
        return text.replace("](../errors.md#", "](#").replace("](", "](protocol/").replace("](protocol/#", "](#")
    (file,) = [file for file in pages.files if file.name.endswith("errors.proto")]
    text = "# Errors\n\n" + moved(pages.file_comment(file)) + (
        "\nA Reason has the same name everywhere: `REASON_LIMIT` in the protocol is `LIMIT` in the label `reason` of metrics, in "
        "`locus -o json`, and as `Reason.LIMIT` in Python.\n")
    for name, element in reasons.items():
        short = name.removeprefix("REASON_")
        text += f"\n## {short} {{#{short.lower()}}}\n\n`{name}` = {element.descriptor.number}. {moved(pages.text(element))}"
        text += f"\n**What to do.** {remedies[short].strip()}\n"
        calls = calls_with_reason(pages, name)
        if calls:
            text += f"\nCalls that document it: {moved(', '.join(calls))}.\n"
    return text
