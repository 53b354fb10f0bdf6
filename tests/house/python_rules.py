"""Rules of Python files: every file has a docstring; public names of the product are also documented and typed."""
import ast

MAX_FUNCTION_LINES = 80
MAX_LINE = 130
PRODUCT = "client/python/"
TESTS = "tests/client/python/"


def python_files(tree, below=""):
    """Returns (path, text) of each Python file."""
    return [(path, text) for path, text in sorted(tree.files.items()) if path.endswith(".py") and path.startswith(below)]


def parsed(path, text):
    """Returns the file's syntax tree and a list of problems. If the file does not parse, the tree is empty and the list
    has one problem.
    """
    try:
        return ast.parse(text), []
    except SyntaxError as error:
        return ast.Module(body=[], type_ignores=[]), [f"{path}:{error.lineno}: is not Python: {error.msg}"]


FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


def python_files_are_tidy(tree):
    """Checks that files parse, open with a docstring, and have no long lines or functions."""
    problems = []
    for path, text in python_files(tree):
        module, broken = parsed(path, text)
        problems += broken
        if not broken and not ast.get_docstring(module):
            problems.append(f"{path}: opens without a docstring that says what it is")
        problems += [f"{path}:{number}: a line of {len(line)} characters, at most {MAX_LINE} are allowed"
                     for number, line in enumerate(text.split("\n"), 1) if len(line) > MAX_LINE]
        for node in ast.walk(module):
            if isinstance(node, FUNCTIONS) and node.end_lineno - node.lineno + 1 > MAX_FUNCTION_LINES:
                problems.append(f"{path}:{node.lineno}: a function of {node.end_lineno - node.lineno + 1} lines, "
                                f"at most {MAX_FUNCTION_LINES} are allowed")
    return problems


def public(body, prefix=""):
    """Yields the public classes, functions and methods of a module or class, each with its full name."""
    for node in body:
        if isinstance(node, (ast.ClassDef, *FUNCTIONS)) and not node.name.startswith("_"):
            yield node, prefix + node.name
            if isinstance(node, ast.ClassDef):
                yield from public(node.body, prefix + node.name + ".")


def untyped(function):
    """Returns the names of the arguments without a type; also `return` if the result has no type."""
    arguments = function.args
    named = arguments.posonlyargs + arguments.args + arguments.kwonlyargs
    extra = [argument for argument in (arguments.vararg, arguments.kwarg) if argument]
    names = [argument.arg for argument in named + extra if argument.annotation is None and argument.arg not in ("self", "cls")]
    return names + ([] if function.returns else ["return"])


def python_names_are_documented(tree):
    """Checks that public names of the package have docstrings and that every function has type hints."""
    problems = []
    for path, text in python_files(tree, PRODUCT):
        module, _ = parsed(path, text)
        problems += [f"{path}:{node.lineno}: {name} has no docstring" for node, name in public(module.body)
                     if not ast.get_docstring(node) and name != "main" and path.startswith(PRODUCT + "locus/")]
        problems += [f"{path}:{node.lineno}: {node.name} has no type for {', '.join(untyped(node))}"
                     for node in ast.walk(module) if isinstance(node, FUNCTIONS) and untyped(node)]
    return problems


def python_tests_mirror_the_sources(tree):
    """Checks that the path and name of each test mirror those of a module."""
    return [f"{path}: there is no source of that name to test" for path, _ in python_files(tree, TESTS)
            if path.endswith("_test.py") and PRODUCT + path[len(TESTS):-len("_test.py")] + ".py" not in tree.files]


RULES = {
    "PythonFilesAreTidy": python_files_are_tidy,
    "PythonNamesAreDocumented": python_names_are_documented,
    "PythonTestsMirrorTheSources": python_tests_mirror_the_sources,
}
