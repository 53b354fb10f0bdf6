"""Rules that ask a tool: the formatter over the sources, the linker's symbol table over the built libraries."""
import os
import shutil
import subprocess

FORMATTED_ENDINGS = (".h", ".cc")
PURE_LIBRARIES = ("core/liblocus_core.a", "server/liblocus_server_core.a")
FILES_A_CALL = 50


class Skip(Exception):
    """The tool or the build is not at hand."""


def symbols_of_other_worlds(lines):
    """Undefined names that belong to gRPC or protobuf, from the output of nm --demangle --undefined-only."""
    return sorted({line.split(" U ", 1)[1].strip() for line in lines
                   if " U " in line and ("grpc" in line.lower() or "google::protobuf" in line)})


def pure_libraries_refer_to_no_grpc(tree, build):
    if build is None:
        raise Skip("no build folder was given")
    problems = []
    for library in PURE_LIBRARIES:
        path = os.path.join(build, library)
        answer = subprocess.run(["nm", "--demangle", "--undefined-only", path], capture_output=True, text=True)
        lines = answer.stdout.splitlines()
        if answer.returncode != 0 or not any(" U " in line for line in lines):
            problems.append(f"{library}: nm read no symbols: {answer.stderr.strip()[:200]}")
        problems += [f"{library}: refers to {name}" for name in symbols_of_other_worlds(lines)]
    return problems


def formatter():
    program = shutil.which("clang-format")
    if program is None:
        raise Skip("clang-format is not installed: ./deploy/packages.sh test")
    return program


def sources_are_formatted(tree, root):
    paths = [path for path in sorted(tree.files) if path.endswith(FORMATTED_ENDINGS)]
    problems = []
    for first in range(0, len(paths), FILES_A_CALL):
        answer = subprocess.run([formatter(), "--dry-run", "-Werror", *paths[first:first + FILES_A_CALL]], cwd=root,
                                capture_output=True, text=True)
        found = [line for line in answer.stderr.splitlines() if "error:" in line]
        problems += found or ([f"clang-format exited with {answer.returncode}: {answer.stderr[:200]}"]
                              if answer.returncode else [])
    return problems


def is_formatted(text, root):
    answer = subprocess.run([formatter(), "--dry-run", "-Werror", "--assume-filename=core/example.cc"], cwd=root, input=text,
                            capture_output=True, text=True)
    return answer.returncode == 0
