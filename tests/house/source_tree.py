"""Files of the project for the repository rules: a map from path to text, and helpers that parse C++ files.

Rules take a Tree, so that the rules can be tested on small examples that exist only in memory.
"""
import os
import re
import subprocess

CODE_ENDINGS = (".h", ".cc")
SKIPPED_FOLDERS = {".git", "build", ".cache", "__pycache__", "node_modules"}


class Tree:
    """Files by their path from the project's root, with '/' between folders."""

    def __init__(self, files, sizes=None):
        self.files = dict(files)
        self.sizes = dict(sizes or {})

    def size(self, path):
        """Returns the size of a file on the disk in bytes; for a file of an example, the size of its text."""
        return self.sizes.get(path, len(self.files[path].encode()))

    def code(self, *rooms):
        """Returns the paths of all headers and sources; if folders are given, only of files below one of them."""
        return [path for path in sorted(self.files)
                if path.endswith(CODE_ENDINGS) and (not rooms or path.startswith(tuple(room + "/" for room in rooms)))]


def listed_by_git(root):
    command = ["git", "-c", "safe.directory=*", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    try:
        answer = subprocess.run(command, cwd=root, capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return [path for path in answer.stdout.decode().split("\0") if path]


def listed_by_walk(root):
    paths = []
    for folder, subfolders, names in os.walk(root):
        subfolders[:] = [name for name in subfolders if name not in SKIPPED_FOLDERS]
        paths += [os.path.relpath(os.path.join(folder, name), root) for name in names]
    return paths


def read_tree(root):
    paths = listed_by_git(root) if os.path.exists(os.path.join(root, ".git")) else None
    files, sizes = {}, {}
    for path in paths if paths is not None else listed_by_walk(root):
        full_path = os.path.join(root, path)
        if os.path.isfile(full_path):
            with open(full_path, encoding="utf-8", errors="replace") as file:
                files[path] = file.read()
            sizes[path] = os.path.getsize(full_path)
    return Tree(files, sizes)


INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(["<])([^">]+)[">]', re.MULTILINE)


def includes(text):
    """Returns (whether the name is in quotes, name of the included file) for each #include."""
    return [(mark == '"', target) for mark, target in INCLUDE.findall(without_comments(text))]


def quoted_includes(text):
    return [target for quoted, target in includes(text) if quoted]


COMMENT_OR_LITERAL = re.compile(
    r'//(?:\\\n|[^\n])*|/\*.*?\*/|R"([^()\\\s]{0,16})\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![0-9a-fA-F])\'(?:\\.|[^\'\\\n])+\'',
    re.DOTALL)


def blank(text):
    return re.sub(r"[^\n]", " ", text)


def without_comments(text):
    """Replaces comments by blanks; keeps line numbers and literals."""
    return COMMENT_OR_LITERAL.sub(lambda m: blank(m.group()) if m.group().startswith(("//", "/*")) else m.group(), text)


def without_comments_and_literals(text):
    """Replaces comments, and literals of strings and characters, by blanks, so that every remaining brace is code."""
    return COMMENT_OR_LITERAL.sub(lambda m: blank(m.group()), text)


PREPROCESSOR = re.compile(r"^[ \t]*#(?:\\\n|[^\n])*", re.MULTILINE)
TYPE_OR_NAMESPACE = re.compile(r"(inline\s+)?namespace\b|extern\s*$|(class|struct|union|enum)\b[^()]*$")
ACCESS = re.compile(r"^(\s*(public|private|protected)\s*:)+")


def after_template(declaration):
    """Returns the declaration without a leading template<...>, because the word `class` in it would be mistaken for
    the definition of a class.
    """
    declaration = ACCESS.sub("", declaration).strip()
    while re.match(r"template\s*<", declaration):
        position, depth = declaration.index("<"), 0
        for position in range(position, len(declaration)):
            depth += {"<": 1, ">": -1}.get(declaration[position], 0)
            if depth == 0:
                break
        declaration = declaration[position + 1:].strip()
    return re.sub(r"^(\[\[[^\]]*\]\]|alignas\s*\([^)]*\))\s*", "", declaration)


def kind_of_brace(declaration):
    """Returns what a brace after `declaration` opens, outside of functions: 'scope', 'function' or 'value'."""
    text = after_template(declaration)
    if TYPE_OR_NAMESPACE.match(re.sub(r"alignas\s*\([^)]*\)|final\b", "", text)):
        return "scope"
    head = re.sub(r"operator\s*(\(\s*\)|[^\s\w(]+)", "operator_", text)
    before_parameters, parenthesis, _ = head.partition("(")
    if not parenthesis or re.search(r"(?<![=!<>])=(?!=)", before_parameters):
        return "value"
    return "function" if head.count("(") == head.count(")") else "value"


def functions(text):
    """Returns (first line, number of lines) of each function with a body. A lambda counts as part of the function
    around it.

    Finds functions by the braces of formatted code, without a parser. A brace directly after a word begins a value,
    such as the initialiser of a member.
    """
    code = PREPROCESSOR.sub(lambda m: blank(m.group()), without_comments_and_literals(text))
    found, open_braces, start, line = [], [], 0, 1
    for position, sign in enumerate(code):
        in_scope = all(kind == "scope" for kind, _ in open_braces)
        if sign == "\n":
            line += 1
        elif sign == "{":
            touches = position > 0 and (code[position - 1].isalnum() or code[position - 1] in "_>)]")
            kind = "value" if not in_scope or touches else kind_of_brace(code[start:position])
            first_line = line - code[start:position].lstrip().count("\n")
            open_braces.append((kind, first_line))
            start = position + 1 if kind == "scope" else start
        elif sign == "}" and open_braces:
            kind, first_line = open_braces.pop()
            if kind == "function":
                found.append((first_line, line - first_line + 1))
            start = position + 1 if kind != "value" else start
        elif sign == ";" and in_scope:
            start = position + 1
    return found
