"""Code blocks of a page in Markdown, and the marks above them. Used by the build of the pages and by their tests.

A mark is an HTML comment directly above a block:

    <!-- not run: REASON -->       the block is not run; REASON is a whole sentence
    <!-- file: NAME -->            the block is saved as NAME for later blocks of the page, and not run
    <!-- fails: CODE -->           the last command of the block exits with CODE, and its errors are shown, too
    <!-- daemon: OPTIONS -->       anywhere in a page: options of the page's locusd; `none` if the page starts its own

A line `--8<-- "PATH"` in a page stands for the content of a file of the repository, so that pages show example programs.
"""
import dataclasses
import os
import re

# Languages of blocks that are run, and of blocks that are only read. A block of any other language is an error.
RUN = {"console", "sh", "bash", "python", "cpp", "lua", "grpcurl"}
DATA = {"text", "json", "ndjson", "yaml", "ini", "toml", "csv", "proto", "xml", "cmake", "diff", "html", "promql", "haproxy",
        "dockerfile", "obj"}
FENCE = re.compile(r"^([ ]*)(`{3,}|~{3,})[ ]*([^`\n]*)$")
MARK = re.compile(r"^\s*<!-- (not run|file|fails): (.*?) -->\s*$")
DAEMON = re.compile(r"^<!-- daemon: (.*?) -->\s*$", re.MULTILINE)
SENTENCE = re.compile(r"[A-Z].*\S \S+ \S.*\.", re.DOTALL)
INCLUDE = re.compile(r'^--8<-- "([^"]+)"$', re.MULTILINE)
TOP = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../..")
HEREDOC = re.compile(r"<<-?\s*(['\"]?)(\w+)\1")


@dataclasses.dataclass
class Block:
    """One block: its language, text and marks, the line of its fence, and whether it directly follows the one before."""
    language: str
    text: str
    line: int
    marks: dict
    follows: bool

    @property
    def is_run(self):
        return self.language in RUN and not {"not run", "file"} & set(self.marks)


def included(text):
    """Returns the text with the content of files in place of the lines that name them."""
    def content(found):
        with open(os.path.join(TOP, found.group(1)), encoding="utf-8") as file:
            return file.read().rstrip("\n")
    return INCLUDE.sub(content, text)


def marks_above(lines, position):
    """Returns the marks in the comments directly above the line at `position`, and the position of the topmost."""
    marks = {}
    while position > 0 and (found := MARK.match(lines[position - 1])):
        marks[found.group(1)] = found.group(2).strip()
        position -= 1
    return marks, position


def blocks_of(text):
    """Returns the blocks of a page in order."""
    lines = text.split("\n")
    blocks, position, last_end = [], 0, None
    while position < len(lines):
        opening = FENCE.match(lines[position])
        if not opening:
            position += 1
            continue
        indent, fence, info = opening.groups()
        end = position + 1
        while end < len(lines) and not re.fullmatch(rf"[ ]*{fence[0]}{{{len(fence)},}}[ ]*", lines[end]):
            end += 1
        body = [line[len(indent):] if line.startswith(indent) else line.lstrip(" ") for line in lines[position + 1:end]]
        marks, top = marks_above(lines, position)
        follows = last_end is not None and not "".join(lines[last_end + 1:top]).strip()
        words = info.split()
        blocks.append(Block(words[0] if words else "", included("".join(line + "\n" for line in body)), position + 1, marks,
                            follows))
        position, last_end = end + 1, end
    return blocks


def daemon_options(text):
    """Returns the options of the page's locusd, or None if the page starts its own."""
    found = DAEMON.search(text)
    words = found.group(1).split() if found else []
    return None if words == ["none"] else words


def commands_of(block):
    """Returns pairs of a command and the output shown below it, of a console block. A command goes on after a backslash
    at the end of a line, and to the end of its here-document.
    """
    pairs, lines, position = [], block.text.split("\n"), 0
    while position < len(lines):
        if not lines[position].startswith("$ "):
            if pairs:
                pairs[-1][1].append(lines[position])
            position += 1
            continue
        command = [lines[position][2:]]
        position += 1
        while command[-1].endswith("\\") and position < len(lines):
            command.append(lines[position].removeprefix("> "))
            position += 1
        document = HEREDOC.search(command[-1])
        while document and position < len(lines):
            command.append(lines[position].removeprefix("> "))
            position += 1
            if command[-1].strip() == document.group(2):
                break
        pairs.append(("\n".join(command), []))
    return [(command, "\n".join(output)) for command, output in pairs]


def faults_of(text):
    """Returns what is wrong with the blocks of a page, as pairs of line and fault."""
    faults = []
    for block in blocks_of(text):
        reason = block.marks.get("not run")
        if not block.language:
            faults.append((block.line, "a block without a language"))
        elif block.language not in RUN | DATA:
            faults.append((block.line, f"a block of the unknown language '{block.language}'"))
        if reason is not None and not SENTENCE.fullmatch(reason):
            faults.append((block.line, f"the reason why the block is not run is no whole sentence: '{reason}'"))
        if block.is_run and block.language == "console" and not commands_of(block):
            faults.append((block.line, "a console block without a command after '$ '"))
    return faults


def is_tested(text):
    """Returns whether a test runs the page and compares something: a console command with its output, or a script with
    the text block after it.
    """
    blocks = blocks_of(text)
    shown = any(output.strip() for block in blocks if block.is_run and block.language == "console"
                for _, output in commands_of(block))
    return shown or any(before.is_run and after.language == "text" and after.follows
                        for before, after in zip(blocks, blocks[1:]))
