"""Rules that run a tool: the formatter on the sources, nm on the built libraries."""
import os
import shutil
import subprocess

FORMATTED_ENDINGS = (".h", ".cc")
PURE_LIBRARIES = ("core/liblocus_index.a", "core/liblocus_core.a", "server/liblocus_server_core.a", "server/liblocus_security.a")
FILES_A_CALL = 50
KERNEL_NAMES = ("ray_kernels_", "region_kernels_", "nearest_kernels_", "crossing_kernels_",
                "grid_kernels_")


class Skip(Exception):
    """Raised if the tool or the build folder that a rule needs is missing."""


def symbols_of_other_worlds(lines):
    """Returns the undefined symbols that belong to gRPC or protobuf. `lines` is the output of nm --demangle
    --undefined-only.
    """
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


def faults_of_a_kernel(lines):
    """Returns the faults of an object that is compiled for one instruction set: more than one exported symbol, or a
    symbol that the linker may merge with a symbol of another object. Takes the output of nm --demangle."""
    exported = [line.split(" T ", 1)[1] for line in lines if " T " in line]
    merged = [line for line in lines if any(f" {kind} " in line for kind in "VvWwu")]
    problems = [] if len(exported) == 1 else [f"exports {len(exported)} symbols, not one: {', '.join(exported)}"]
    return problems + [f"has a symbol that may be merged with another object's: {line.strip()}" for line in merged]


def kernels_export_one_symbol(build):
    if build is None:
        raise Skip("no build folder was given")
    objects = [os.path.join(folder, name) for folder, _, names in os.walk(os.path.join(build, "core"))
               for name in names if name.startswith(KERNEL_NAMES) and name.endswith(".o")]
    with open(os.path.join(build, "CMakeCache.txt"), encoding="utf-8") as cache:
        settings = cache.read()
    if not objects or "CMAKE_BUILD_TYPE:STRING=Release" not in settings:
        raise Skip("no kernels as they are shipped: not a Release build, or a processor without them")
    problems = []
    for path in sorted(objects):
        answer = subprocess.run(["nm", "--demangle", path], capture_output=True, text=True)
        problems += [f"{os.path.basename(path)}: {problem}" for problem in faults_of_a_kernel(answer.stdout.splitlines())]
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
