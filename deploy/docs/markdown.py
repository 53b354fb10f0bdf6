"""Writes plain text of the project, such as comments of the protocol and help texts, as Markdown."""
import re

ITEM = re.compile(r"( *)- (.*)")
CODE = re.compile(r"(`[^`\n]+`)")
ENTITIES = {"&": "&amp;", "<": "&lt;", ">": "&gt;"}


def escaped(text):
    """Returns one line escaped; words between backticks stay code."""
    parts = CODE.split(text)
    for at in range(0, len(parts), 2):
        parts[at] = re.sub(r"[\\*_\[\]{}|#`]", r"\\\g<0>", re.sub(r"[&<>]", lambda found: ENTITIES[found.group()], parts[at]))
    line = "".join(parts)
    return re.sub(r"^(\d+)([.)] )", r"\1\\\2", re.sub(r"^([+-])( |$)", r"\\\1\2", line))


def markdown_of(text, linked=lambda line: line):
    """Returns a text of paragraphs and lists as Markdown. A list item begins with `- `; lines that go on are indented below
    its text. `linked` may put links into escaped lines.
    """
    lines, state, depth = [], "", 0
    for raw in text.rstrip().split("\n"):
        item = ITEM.match(raw)
        if not raw.strip():
            lines.append("")
            state = ""
        elif item:
            depth = len(item.group(1)) // 2
            # A list needs an empty line before it, or it becomes a part of the paragraph.
            lines += [""] * (state == "text")
            lines.append("    " * depth + "- " + linked(escaped(item.group(2))))
            state = "list"
        elif raw.startswith("  ") and state == "list":
            lines.append("    " * depth + "  " + linked(escaped(raw.strip())))
        else:
            lines += [""] * (state == "list")
            lines.append(linked(escaped(raw.strip())))
            state = "text"
    return "\n".join(lines).strip("\n") + "\n"


def definition(term, text):
    """Returns one item of a definition list; `text` is Markdown."""
    lines = text.rstrip("\n").split("\n")
    body = "".join("    " + line + "\n" if line else "\n" for line in lines[1:])
    return f"\n{term}\n:   {lines[0]}\n{body}"


def table(head, rows):
    """Returns a table; the cells are Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |\n" for line in lines)
