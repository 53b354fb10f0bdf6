"""Rules about includes: allowed directions between rooms, third-party headers and cycles."""
import posixpath
import re

from source_tree import includes, quoted_includes

INDEX_STRUCTURES = ("list", "bvh", "hash_grid", "kd_tree", "octree", "bsp_tree", "sphere_tree", "grid", "kd_points")

# Folders that the sources of a folder may include, in addition to their own folder. A name that ends with "/*" stands
# for the folder and all folders below it, another name only for the folder itself. "proto" is the code generated from
# the protocol.
ALLOWED = {
    "core/base": [],
    "core/geometry": ["core/base"],
    "core/mesh": ["core/geometry", "core/base"],
    "core/index": ["core/geometry", "core/base"],
    # The folders of core/scene from the bottom up: stored content, its updates, snapshots and readers, the log, and the
    # scene.
    "core/scene/objects": ["core/index/*", "core/geometry", "core/base"],
    "core/scene/statics": ["core/index/*", "core/mesh", "core/geometry", "core/base"],
    "core/scene/updates": ["core/scene/objects", "core/scene/statics", "core/index/*", "core/geometry", "core/base"],
    "core/scene/snapshot": ["core/scene/objects", "core/scene/statics", "core/index/*", "core/geometry", "core/base"],
    "core/scene/readers": ["core/scene/snapshot", "core/base"],
    "core/scene/log": ["core/scene/objects", "core/scene/statics", "core/scene/updates", "core/scene/snapshot",
                       "core/index/*", "core/mesh", "core/geometry", "core/base"],
    "core/scene": ["core/scene/*", "core/index/*", "core/mesh", "core/geometry", "core/base"],
    "core/query": ["core/scene/*", "core/index/*", "core/geometry", "core/base"],
    "core/query/kinds": ["core/query", "core/scene/*", "core/index/*", "core/geometry", "core/base"],
    "core/query/run": ["core/query", "core/query/kinds", "core/scene/*", "core/index/*", "core/geometry", "core/base"],
    "server": ["server/*", "core/*"],
    "server/config": ["core/base"],
    "server/scheduling": ["core/*", "server/config"],
    "server/cluster": ["server/scheduling", "core/scene/log", "core/base"],
    "server/storage/rows": ["core/*"],
    "server/storage/rocksdb": ["server/storage/rows", "core/*"],
    "server/storage/postgres": ["server/storage/rows", "core/*"],
    "server/storage/integrity": ["server/storage/rocksdb", "server/storage/rows", "core/*"],
    "server/storage": ["server/storage/*", "server/cluster", "core/*"],
    "server/connections": ["server/config", "core/base"],
    "server/security": ["server/config", "core/base"],
    "server/observability": ["server/connections", "server/security", "server/config", "core/index", "core/base"],
    "server/convert": ["core/*", "proto"],
    "server/rpc": ["server/convert", "server/connections", "server/security", "server/scheduling", "server/observability",
                   "server/config", "core/base", "proto"],
    "server/host": ["server/rpc", "server/connections", "server/scheduling", "server/observability", "server/config",
                    "core/*"],
    "server/services/cluster": ["server/cluster", "server/host", "server/convert", "server/scheduling", "server/storage",
                                "server/storage/postgres", "server/observability", "server/config", "core/*", "proto"],
    "server/services": ["server/services/cluster", "server/rpc", "server/host", "server/connections", "server/convert",
                        "server/scheduling", "server/storage", "server/security", "server/observability", "server/config",
                        "core/*", "proto"],
    # The client library may include only status_macros.h of core, and only in sources, because this header is not
    # installed.
    "client/lib": ["proto", "core/base/status_macros.h"],
    # The embedded server joins the client library and the server in one process.
    "client/embedded": ["client/lib", "server/services", "server/storage", "server/observability", "server/config",
                        "core/scene/log", "core/base/status_macros.h"],
    "client/embedded/examples": ["client/embedded", "client/lib"],
    "client/cli": ["client/cli/security", "client/lib", "core/base"],
    "client/cli/security": ["client/lib", "core/base"],
    "client/cli/commands": ["client/cli/*", "client/lib", "core/geometry", "core/base"],
    "client/cli/rows": ["client/cli", "client/cli/rows/bulk", "client/lib", "core/base"],
    "client/cli/rows/bulk": ["core/base"],
    "client/cli/levels": ["client/cli", "client/cli/levels/import", "client/lib", "core/base"],
    "client/cli/levels/import": ["client/cli/levels/import/*", "core/geometry", "core/base"],
    "client/cli/levels/import/quake": ["client/cli/levels/import", "core/geometry", "core/base"],
    "client/cli/levels/generate": ["client/cli/levels/import", "core/geometry", "core/base"],
    "client/cli/levels/export": ["client/cli", "client/cli/rows", "client/cli/levels/import", "client/lib", "core/geometry",
                                 "core/base"],
    "client/cli/extras/demo": ["client/cli", "client/cli/levels/*", "client/lib", "core/geometry", "core/base"],
    "client/cli/extras/bench": ["client/cli", "client/cli/extras/demo", "client/lib", "core/geometry", "core/base"],
    "client/cli/extras/completion": ["client/cli"],
    "client/cli/extras/top": ["client/cli", "client/lib", "core/base"],
    "client/cli/extras/cluster": ["client/cli", "client/lib", "core/base"],
    "client/cli/extras/verify": ["client/cli/levels/generate", "client/lib"],
    # The structures of the library are timed in the command line, on a scene's own values.
    "client/cli/extras/tune/structures": ["core/index/*", "core/geometry", "core/base"],
    "client/cli/extras/tune": ["client/cli", "client/cli/extras/tune/structures", "client/cli/extras/verify",
                               "client/cli/levels/generate", "client/cli/rows", "client/lib", "core/geometry", "core/base"],
    "client/cli/extras/render": ["client/cli", "client/lib", "core/geometry", "core/base"],
    "client/cli/backup": ["client/cli", "client/lib", "core/base"],
    "client/cli/script": ["client/cli", "client/lib", "core/base"],
    "client/cli/shell": ["client/cli", "client/cli/script", "client/cli/extras/completion", "client/lib", "core/base"],
    "deploy/manual": ["client/cli", "server/config"],
}
# Kernels are compiled for instruction sets that a processor can lack, so they may include only plain data of the tree.
ALLOWED["core/index/bvh/kernels"] = ["core/index/bvh", "core/base"]
ALLOWED["core/index/hash_grid/kernels"] = ["core/base"]
ALLOWED.update({"core/index/" + name: ["core/index", "core/geometry", "core/base"] for name in INDEX_STRUCTURES})
ALLOWED["core/index/queries"] = ["core/index", "core/geometry", "core/base"]
ALLOWED["core/index/hash_grid"].append("core/index/hash_grid/kernels")

# Prefixes of third-party headers, each with the folders that may include headers with this prefix. A folder stands also
# for all folders below it. Tests may include all headers.
THIRD_PARTY = {
    "grpc": ["server/rpc", "server/services", "server/convert", "server/observability", "client/lib", "client/embedded"],
    "google/protobuf/": ["server/rpc", "server/services", "server/convert", "client/lib", "client/cli/script",
                         "client/cli/extras/verify"],
    "spdlog/": ["server/observability"],
    "zlib.h": ["server/rpc"],
    "prometheus/": ["server/observability"],
    "rocksdb/": ["server/storage"],
    "libpq-fe.h": ["server/storage", "tests/bench"],
    "xxhash.h": ["server/storage"],
    "curl/": ["client/cli/extras/top"],
    "CLI/": ["server/config", "client/cli", "deploy/manual"],
    "nlohmann/": ["server/config", "server/rpc", "client/cli"],
    "assimp/": ["client/cli/levels/import"],
    "zip.h": ["client/cli/levels/import"],
    "seccomp.h": ["client/cli/levels/import"],
    "openssl/": ["server/services", "server/rpc", "server/security", "server/observability", "client/lib", "client/cli/security"],
    "rhonabwy.h": ["server/security"],
    "jansson.h": ["server/security"],
    "png.h": ["client/cli/extras/render"],
    "lua.hpp": ["client/cli/script"],
    "histedit.h": ["client/cli/shell"],
    "embree3/": ["tests/bench"],
    "btBulletCollisionCommon.h": ["tests/bench"],
    "BulletCollision/": ["tests/bench"],
    "boost/": ["server/observability", "tests/bench"],
    "CGAL/": ["tests/bench"],
    "nanoflann.hpp": ["tests/bench"],
}
FORBIDDEN_IN_CORE = {"iostream", "fstream", "filesystem"}
INTRINSICS = "immintrin.h"
KERNELS = ("core/index/bvh/kernels/", "core/index/hash_grid/kernels/")
# Files that may include a header of the system to advise the kernel about memory. madvise(), which asks for large
# pages, is allowed because it changes no value.
MEMORY_ADVICE = {"core/base/large_array.cc": "sys/mman.h"}
CLOCK_FILES = re.compile(r"core/(?:base/(?:mutex|progress_writer)|scene/(?:scene|readers/reader_tracker))\.(?:h|cc)")

# Pairs of a folder and its parent that the rule about cycles treats as one folder, because the folder was split only to
# limit its size.
ONE_ROOM = {"client/cli/levels/import/quake": "client/cli/levels/import"}


def room_of_include(target):
    """Returns the folder to which an included file belongs, or None for Abseil and other libraries."""
    if target.startswith("locus/"):  # generated from the protocol
        return "proto"
    top = target.split("/")[0]
    return posixpath.dirname(target) if top in ("core", "server", "client", "tests", "proto", "deploy") else None


def is_library(target):
    return target.startswith(("absl/", "gtest/", "gmock/")) or any(target.startswith(start) for start in THIRD_PARTY)


def may_include(folder, room):
    if room == folder:
        return True
    return any(room == entry or (entry.endswith("/*") and (room + "/").startswith(entry[:-1]))
               for entry in ALLOWED[folder])


def includes_follow_the_directions(tree):
    problems = []
    for path in tree.code("core", "server", "client", "deploy"):
        folder = posixpath.dirname(path)
        if folder not in ALLOWED:
            problems.append(f"{path}: the folder {folder} has no entry in the table of allowed includes")
            continue
        for target in quoted_includes(tree.files[path]):
            room = room_of_include(target)
            if room not in (None, "tests") and not may_include(folder, room) and target not in ALLOWED[folder]:
                problems.append(f"{path}: {folder} may not include {target}")
    return problems


def index_structures_do_not_see_each_other(tree):
    problems = []
    for path in tree.code(*("core/index/" + name for name in INDEX_STRUCTURES)):
        own = path.split("/")[2]
        for target in quoted_includes(tree.files[path]):
            part = target.split("/")
            if target.startswith("core/index/") and len(part) > 3 and part[2] != own:
                problems.append(f"{path}: the {own} sees the {part[2]} through {target}")
    return problems


def core_stands_alone(tree):
    problems = []
    for path in tree.code("core"):
        for quoted, target in includes(tree.files[path]):
            if quoted and not target.startswith(("core/", "absl/")):
                problems.append(f"{path}: the core includes {target}")
            elif not quoted and (target == INTRINSICS and path.startswith(KERNELS) or target == MEMORY_ADVICE.get(path)):
                continue
            elif not quoted and ("/" in target or target.endswith(".h") or target in FORBIDDEN_IN_CORE):
                problems.append(f"{path}: the core includes <{target}>, which is neither computation nor C++20")
    return problems


def core_reads_no_clock(tree):
    return [f"{path}: <chrono> is for core/base/{{mutex,progress_writer}}.*, core/scene/scene.* and core/scene/readers/"
            "reader_tracker.* only"
            for path in tree.code("core") if not CLOCK_FILES.fullmatch(path)
            for _, target in includes(tree.files[path]) if target == "chrono"]


def libraries_stay_in_their_rooms(tree):
    problems = []
    for path in tree.code("core", "server", "client", "deploy"):
        for _, target in includes(tree.files[path]):
            for start, rooms in THIRD_PARTY.items():
                if target.startswith(start) and not path.startswith(tuple(room + "/" for room in rooms)):
                    problems.append(f"{path}: {target} is for {', '.join(rooms)} only")
    return problems


def nothing_includes_tests(tree):
    return [f"{path}: includes {target}" for path in tree.code("core", "server", "client", "deploy")
            for _, target in includes(tree.files[path]) if "tests/" in target]


def includes_start_at_the_root(tree):
    problems = []
    for path in tree.code():
        for target in quoted_includes(tree.files[path]):
            room = room_of_include(target)
            if room is None and not is_library(target):
                problems.append(f"{path}: {target} is not written from the project's root")
            elif room not in (None, "proto") and target not in tree.files and target + ".in" not in tree.files:
                problems.append(f"{path}: {target} does not exist")
    return problems


def cycles(graph):
    """Returns the sets of nodes that reach each other. Not recursive. Source: Tarjan, Depth-first search and linear
    graph algorithms, 1972.
    """
    number, low, on_stack, stack, found = {}, {}, set(), [], []
    for root in sorted(graph):
        work = [] if root in number else [(root, iter(sorted(graph[root])))]
        if work:
            number[root] = low[root] = len(number)
            stack.append(root)
            on_stack.add(root)
        while work:
            node, rest = work[-1]
            following = next(rest, None)
            if following is None:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == number[node]:
                    component = []
                    while not component or component[-1] != node:
                        component.append(stack.pop())
                        on_stack.discard(component[-1])
                    if len(component) > 1 or node in graph[node]:
                        found.append(sorted(component))
            elif following not in number:
                number[following] = low[following] = len(number)
                stack.append(following)
                on_stack.add(following)
                work.append((following, iter(sorted(graph.get(following, ())))))
            elif following in on_stack:
                low[node] = min(low[node], number[following])
    return found


def file_graph(tree):
    return {path: {target for target in quoted_includes(tree.files[path]) if target in tree.files} for path in tree.code()}


def files_have_no_cycle(tree):
    return ["files include each other: " + " ".join(cycle) for cycle in cycles(file_graph(tree))]


def folders_have_no_cycle(tree):
    graph = {}
    for path, targets in file_graph(tree).items():
        folder = posixpath.dirname(path)
        folder = ONE_ROOM.get(folder, folder)
        for target in targets:
            other = ONE_ROOM.get(posixpath.dirname(target), posixpath.dirname(target))
            graph.setdefault(other, set())
            if other != folder:
                graph.setdefault(folder, set()).add(other)
    return ["folders include each other: " + " ".join(cycle) for cycle in cycles(graph)]


RULES = {
    "IncludesFollowTheDirections": includes_follow_the_directions,
    "IndexStructuresDoNotSeeEachOther": index_structures_do_not_see_each_other,
    "CoreStandsAlone": core_stands_alone,
    "CoreReadsNoClock": core_reads_no_clock,
    "LibrariesStayInTheirRooms": libraries_stay_in_their_rooms,
    "NothingIncludesTests": nothing_includes_tests,
    "IncludesStartAtTheRoot": includes_start_at_the_root,
    "FilesHaveNoIncludeCycle": files_have_no_cycle,
    "FoldersHaveNoIncludeCycle": folders_have_no_cycle,
}
