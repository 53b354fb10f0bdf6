"""Rules about files and folders: sizes, guards, comments, layout, names, and forbidden text."""
import posixpath
import re
import statistics

from source_tree import functions, without_comments_and_literals

MAX_FILE_LINES = 600
MAX_FUNCTION_LINES = 80
MAX_README_LINES = 60
MAX_ROOT_README_LINES = 150
ROOMS = ("proto", "server", "client", "core", "deploy", "tests")
TOP_LEVEL = set(ROOMS) | {"CMakeLists.txt", "README.md", "SECURITY.md", "LICENSE", "CMakePresets.json", ".ci",
                          ".github", ".clang-format", ".clang-tidy", ".gitignore"}
MEASURED_ENDINGS = (".h", ".cc", ".proto", ".py", ".sh", ".txt")


def line_count(text):
    return text.count("\n") + (not text.endswith("\n") and text != "")


def files_are_short(tree):
    return [f"{path}: {line_count(text)} lines, at most {MAX_FILE_LINES} are allowed"
            for path, text in sorted(tree.files.items())
            if path.endswith(MEASURED_ENDINGS) and line_count(text) > MAX_FILE_LINES]


def functions_are_short(tree):
    return [f"{path}:{line}: a function of {length} lines, at most {MAX_FUNCTION_LINES} are allowed"
            for path in tree.code() for line, length in functions(tree.files[path]) if length > MAX_FUNCTION_LINES]


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def sizes(tree):
    """Returns one line for each kind of file: the number of files or functions, and their lengths."""
    lines = []
    for name, rooms in (("product", ("core", "server", "client")), ("tests", ("tests",))):
        paths = tree.code(*rooms)
        files = [line_count(tree.files[path]) for path in paths]
        bodies = [length for path in paths for _, length in functions(tree.files[path])]
        for kind, values in (("files", files), ("functions", bodies)):
            if values:
                lines.append(f"{name}: {len(values)} {kind}, {sum(values)} lines, median {statistics.median(values):g}, "
                             f"p90 {percentile(values, 0.9)}, max {max(values)}")
    return lines


def guard_of(path):
    return "LOCUS_" + re.sub(r"[^A-Z0-9]", "_", path.upper()) + "_"


def headers_have_guards(tree):
    problems = []
    for path in tree.code():
        guard = guard_of(path)
        frame = re.compile(rf"(//[^\n]*\n|\s)*#ifndef {guard}\n#define {guard}\n.*\n#endif  // {guard}\n", re.DOTALL)
        if path.endswith(".h") and not frame.fullmatch(tree.files[path]):
            problems.append(f"{path}: is not framed by the include guard {guard}")
    return problems


def headers_open_with_a_paragraph(tree):
    problems = []
    for path in tree.code():
        opening = re.match(r"(?://[^\n]*\n)*", tree.files[path]).group()
        words = opening.replace("//", " ").split()
        if path.endswith(".h") and (len(words) < 6 or "." not in opening):
            problems.append(f"{path}: opens without a comment that says what it is and for whom")
    return problems


def top_level_is_closed(tree):
    entries = {path.split("/")[0] for path in tree.files}
    return [f"{entry}: does not belong at the top level" for entry in sorted(entries - TOP_LEVEL)] + \
        [f"{entry}: is missing at the top level" for entry in sorted(TOP_LEVEL - entries)]


def rooms_have_short_readmes(tree):
    problems = [f"{room}/README.md: is missing" for room in ROOMS if room + "/README.md" not in tree.files]
    for path, text in sorted(tree.files.items()):
        limit = MAX_ROOT_README_LINES if path == "README.md" else MAX_README_LINES
        if posixpath.basename(path) == "README.md" and line_count(text) > limit:
            problems.append(f"{path}: {line_count(text)} lines, at most {limit} are allowed")
    return problems


PICTURE_ENDINGS = (".png", ".jpg", ".jpeg", ".gif", ".webp", ".bmp", ".ico")
PICTURES = {"deploy/quickstart.png": 300 * 1024}  # maximum size in bytes, so that a clone stays small


def pictures_are_few_and_small(tree):
    pictures = [path for path in sorted(tree.files) if path.endswith(PICTURE_ENDINGS)]
    return [f"{path}: a picture that is not listed" for path in pictures if path not in PICTURES] + \
        [f"{path}: {tree.size(path)} bytes, at most {PICTURES[path]} are allowed" for path in pictures
         if path in PICTURES and tree.size(path) > PICTURES[path]]


# The words are split into parts, so that this file does not contain the forbidden words.
UNFINISHED = re.compile(r"\b(" + "|".join(("TO" + "DO", "FIX" + "ME", "XX" + "X", "HA" + "CK")) + r")\b")
MACHINE_PATH = re.compile(r"(?<![\w.}/-])/(?:" + "|".join(("wo" + "rk", "ro" + "ot", "ho" + "me", "Us" + "ers")) +
                          r")/|\.\./sha" + "red|/tmp/w" + "t\\b")


def each_line(tree, pattern, message):
    return [f"{path}:{number}: {message}: {match.group()}" for path, text in sorted(tree.files.items())
            if path != "LICENSE" and not path.endswith(PICTURE_ENDINGS)
            for number, line in enumerate(text.split("\n"), 1) for match in pattern.finditer(line)]


# Matches code that returns a failed status unchanged. Groups: the variable's name, and its name in the returned
# expression.
WRITTEN_OUT_RETURN = re.compile(r"if \((?:[^;{}]*; )?!(\w+)\.ok\(\)\)\s*\{?\s*return (?:std::move\()?\1\)?(?:\.status\(\))?;")


def statuses_return_by_macro(tree):
    """Finds written-out returns that a macro, RETURN_IF_ERROR or ASSIGN_OR_RETURN, could replace. Statuses of other
    libraries are exempt.
    """
    problems = []
    for path in tree.code("core", "server", "client"):
        text = re.sub(r"(?m)^\s*//.*", "", tree.files[path])
        for match in WRITTEN_OUT_RETURN.finditer(text):
            foreign = re.search(rf"\b(?:rocksdb|grpc)::Status {match.group(1)}\b", text[:match.end()])
            if path != "core/base/status_macros.h" and not foreign:
                problems.append(f"{path}: write RETURN_IF_ERROR or ASSIGN_OR_RETURN: {match.group()}")
    return problems


def nothing_is_left_unfinished(tree):
    return each_line(tree, UNFINISHED, "unfinished work")


def no_path_of_a_machine(tree):
    return each_line(tree, MACHINE_PATH, "a path of one machine")


# Tests whose path and name do not correspond to a source file, each with the reason.
MIRROR_EXCEPTIONS = {
    "tests/client/cli/exit_code_test.cc": "the program as a child process: exit codes and streams",
    "tests/core/geometry/shape_ray_test.cc": "ray tests of every shape, whose chords are in ray_convex",
    "tests/core/geometry/watertight_test.cc": "leaks between neighbouring triangles, a matter of several files",
}
MIRRORED = ("tests/core", "tests/server", "tests/client", "tests/deploy")


def subjects(path):
    """Returns the names of sources that a test may belong to: hash_grid_threads_test.cc may belong to
    hash_grid_threads, hash_grid or hash.
    """
    words = path[len("tests/"):-len("_test.cc")].split("_")
    return {"_".join(words[:count]) for count in range(1, len(words) + 1)}


def tests_mirror_the_sources(tree):
    return [f"{path}: there is no source of that name to test" for path in tree.code(*MIRRORED)
            if path.endswith("_test.cc") and path not in MIRROR_EXCEPTIONS
            and not any(subject + ending in tree.files for subject in subjects(path) for ending in (".h", ".cc"))]


def stale_exceptions(tree):
    return [f"{path}: is an exception of the mirror but does not exist" for path in MIRROR_EXCEPTIONS
            if path not in tree.files]


NAMESPACES = {"core": "locus", "server": "locus::server", "client/lib": "locus::client", "client/embedded": "locus::client",
              "client/cli": "locus::cli",
              "tests": "locus"}
OUTER_NAMESPACE = re.compile(r"^namespace ([\w:]+) \{", re.MULTILINE)
FOREIGN_TO_CORE = re.compile(r"locus::(server|client|cli)\b")


def rooms_use_their_namespace(tree):
    problems = []
    for path in tree.code("core", "server", "client"):
        expected = NAMESPACES["/".join(path.split("/")[:2])] if path.startswith("client/") else NAMESPACES[path.split("/")[0]]
        code = without_comments_and_literals(tree.files[path])
        opened = OUTER_NAMESPACE.findall(code)
        if not opened and posixpath.basename(path) not in ("main.cc", "status_macros.h"):
            problems.append(f"{path}: has nothing in namespace {expected}")
        # A file may open the namespace of its top-level folder, and namespaces inside it. The namespace of core is
        # locus, which contains those of the other folders, so core must not open the namespaces of the other folders.
        for name in opened:
            inside = name == expected or name.startswith(expected + "::")
            nested = name != "locus" and "locus" not in name.split("::")[0] and expected in opened
            if not (inside or nested) or (expected == "locus" and FOREIGN_TO_CORE.match(name)):
                problems.append(f"{path}: opens namespace {name} instead of {expected}")
    return problems


RULES = {
    "FilesAreShort": files_are_short,
    "FunctionsAreShort": functions_are_short,
    "HeadersHaveGuards": headers_have_guards,
    "HeadersOpenWithAParagraph": headers_open_with_a_paragraph,
    "TopLevelIsClosed": top_level_is_closed,
    "RoomsHaveShortReadmes": rooms_have_short_readmes,
    "PicturesAreFewAndSmall": pictures_are_few_and_small,
    "StatusesReturnByMacro": statuses_return_by_macro,
    "NothingIsLeftUnfinished": nothing_is_left_unfinished,
    "NoPathOfAMachine": no_path_of_a_machine,
    "TestsMirrorTheSources": tests_mirror_the_sources,
    "RoomsUseTheirNamespace": rooms_use_their_namespace,
}
