"""Small example trees: one that keeps all rules, and others that each break one rule. A file whose text is None is
removed from the tree.
"""
import language_rules

HEADER = """// Three numbers: a position or a direction in world units, for all rooms. Plain data, so threads share it freely.
#ifndef {guard}
#define {guard}

{includes}namespace {namespace} {{

struct Thing {{
  int count = 0;
}};

}}  // namespace {namespace}

#endif  // {guard}
"""


def header(path, namespace, *targets):
    guard = "LOCUS_" + path.upper().replace("/", "_").replace(".", "_") + "_"
    lines = "".join(f"#include {target}\n" for target in targets)
    return HEADER.format(guard=guard, namespace=namespace, includes=lines + "\n" if lines else "")


def core(path, *targets):
    return {path: header(path, "locus", *targets)}


def server(path, *targets):
    return {path: header(path, "locus::server", *targets)}


def source(body):
    return {"core/geometry/body.cc": "namespace locus {\n\n" + body + "\n}  // namespace locus\n"}


def lines(count):
    return "  step();\n" * count


MODULE = "client/python/locus/thing.py"
README = "# room\n\nWhat it is.\n"
GOOD_EXAMPLE = {
    **core("core/base/mutex.h", "<chrono>"),
    **core("core/geometry/vec3.h", '"absl/types/span.h"', '"core/base/mutex.h"', "<vector>"),
    **core("core/index/spatial_index.h", '"core/geometry/vec3.h"'),
    **core("core/index/list/list_index.h", '"core/index/spatial_index.h"'),
    **core("core/scene/scene.h", "<chrono>", '"core/index/list/list_index.h"'),
    **server("server/config/server_config.h", '"CLI/CLI.hpp"', '"core/base/mutex.h"'),
    **server("server/services/query_service.h", "<grpcpp/server_context.h>", '"locus/v1/query_service.pb.h"',
             '"core/scene/scene.h"'),
    "core/geometry/vec3.cc": '#include "core/geometry/vec3.h"\n\nnamespace locus {\n\n'
                             'Vec3::Vec3(double x) : x_{x}, braces_("{{{") {\n  if (x > 0) {\n    grow({1, 2});\n  }\n}\n\n'
                             "}  // namespace locus\n",
    "server/main.cc": '#include "server/services/query_service.h"\n\nint main() { return 0; }\n',
    "tests/core/geometry/vec3_test.cc": '#include "core/geometry/vec3.h"\n\nnamespace locus {\n}  // namespace locus\n',
    MODULE: '"""Things."""\n\n\nclass Thing:\n    """A thing."""\n\n    def grow(self, by: int = 1) -> None:\n'
            '        """Makes it larger."""\n\n    def _grown(self) -> int:\n        return 1\n',
    "tests/client/python/locus/thing_test.py": '"""Tests of things."""\n',
    **{room + "/README.md": README for room in ("proto", "server", "client", "core", "deploy", "tests")},
    **{path: "content\n" for path in language_rules.PAGES},
    **{path: "content\n" for path in ("README.md", "SECURITY.md", "CMakeLists.txt", "LICENSE", "CMakePresets.json",
                                      ".ci/run", ".github/CONTRIBUTING.md", ".clang-format", ".clang-tidy", ".gitignore")},
}

LONG_FUNCTION = "void walk() {\n" + lines(79) + "}\n"
LONG_CONSTRUCTOR = "template <class T = int>\nWalker<T>::Walker(Options o = {}) : a_{1}, b_(2) {\n" + lines(90) + "}\n"
LONG_METHOD = "class Walker final : public Base {\n public:\n  bool operator==(const Walker&) const {\n" + lines(80) + "  }\n};\n"
LONG_OPERATOR = "int Walker::operator()(int a) const {\n" + lines(80) + "}\n"
LONG_TEST = 'TEST(WalkerTest, Walks) {\n  say("}");\n  say(\'{\');  // }\n' + lines(80) + "}\n"
LONG_INNER = "void walk() {\n  const auto inner = [&] {\n" + lines(85) + "  };\n}\n"

BAD_EXAMPLES = {
    "PythonFilesAreTidy": [{MODULE: "def grow(:\n"}, {MODULE: "import os\n"},
                           {"tests/run.py": '"""Long."""\nx = "' + "y" * 130 + '"\n'},
                           {MODULE: '"""Long."""\ndef f() -> None:\n' + "    f()\n" * 80}],
    "PythonNamesAreDocumented": [
        {MODULE: '"""Things."""\ndef grow() -> None:\n    pass\n'},
        {MODULE: '"""Things."""\nclass Thing:\n    """A thing."""\n    def grow(self) -> None:\n        pass\n'},
        {MODULE: '"""Things."""\ndef _grow(by) -> None:\n    pass\n'}, {MODULE: '"""Things."""\ndef _grow():\n    pass\n'},
    ],
    "PythonTestsMirrorTheSources": [{"tests/client/python/locus/gone_test.py": '"""Gone."""\n'},
                                    {"tests/client/python/thing_test.py": '"""Elsewhere."""\n'}],
    "IncludesFollowTheDirections": [
        core("core/geometry/vec3.h", '"core/index/spatial_index.h"'),
        core("core/mesh/mesh.h", '"core/scene/scene.h"'),
        core("core/index/spatial_index.h", '"core/index/list/list_index.h"'),
        core("core/scene/scene.h", '"tests/support/run_batch.h"'),
        server("server/scheduling/pool.h", '"server/services/query_service.h"'),
        server("server/config/server_config.h", '"core/scene/scene.h"'),
        {"client/lib/client.h": header("client/lib/client.h", "locus::client", '"core/geometry/vec3.h"')},
        {"client/cli/run.cc": '#include "server/config/server_config.h"\n'},
        core("core/unlisted/thing.h"),
    ],
    "IndexStructuresDoNotSeeEachOther": [core("core/index/bvh/bvh.h", '"core/index/list/list_index.h"')],
    "CoreStandsAlone": [
        core("core/base/log.h", "<iostream>"), core("core/base/file.h", "<fstream>"), core("core/base/path.h", "<filesystem>"),
        core("core/base/socket.h", "<sys/socket.h>"), core("core/base/call.h", "<grpcpp/grpcpp.h>"),
        core("core/base/proto.h", '"locus/v1/geometry.pb.h"'), core("core/base/log.h", '"spdlog/spdlog.h"'),
        core("core/base/config.h", '"server/config/server_config.h"'),
        {"core/base/odd.cc": "  #  include <iostream>\n"}, core("core/index/bvh/bvh.h", "<immintrin.h>"),
    ],
    "CoreReadsNoClock": [core("core/query/options.h", "<chrono>"), core("core/scene/scene_writer.h", "<chrono>")],
    "LibrariesStayInTheirRooms": [
        server("server/services/log.h", '"spdlog/spdlog.h"'), server("server/scheduling/call.h", "<grpcpp/grpcpp.h>"),
        core("core/base/option.h", '"CLI/CLI.hpp"'), server("server/scheduling/tree.h", "<boost/geometry.hpp>"),
        {"client/lib/json.h": header("client/lib/json.h", "locus::client", "<nlohmann/json.hpp>")},
    ],
    "NothingIncludesTests": [core("core/base/ids.h", '"tests/support/random.h"')],
    "IncludesStartAtTheRoot": [core("core/base/ids.h", '"mutex.h"'), core("core/base/ids.h", '"core/base/gone.h"'),
                               core("core/base/ids.h", '"../base/mutex.h"')],
    "FilesHaveNoIncludeCycle": [
        {**core("core/base/a.h", '"core/base/b.h"'), **core("core/base/b.h", '"core/base/c.h"'),
         **core("core/base/c.h", '"core/base/a.h"')},
        core("core/base/a.h", '"core/base/a.h"'),
    ],
    "FoldersHaveNoIncludeCycle": [
        {**core("core/mesh/a.h", '"core/query/b.h"'), **core("core/query/b.h"), **core("core/query/c.h", '"core/mesh/a.h"')},
    ],
    "FilesAreShort": [{"core/base/long.cc": "\n" * 601}, {"proto/locus/v1/long.proto": "x\n" * 600 + "x"}],
    "FunctionsAreShort": [source(body) for body in (LONG_FUNCTION, LONG_CONSTRUCTOR, LONG_METHOD, LONG_OPERATOR, LONG_TEST,
                                                    LONG_INNER)],
    "HeadersHaveGuards": [
        {"core/base/ids.h": header("core/base/other.h", "locus")}, {"core/base/ids.h": "// Ids.\n#pragma once\n"},
        {"core/base/ids.h": header("core/base/ids.h", "locus") + "int after;\n"},
    ],
    "HeadersOpenWithAParagraph": [
        {"core/base/ids.h": header("core/base/ids.h", "locus").split("\n", 1)[1]},
        {"core/base/ids.h": "// Ids.\n" + header("core/base/ids.h", "locus").split("\n", 1)[1]},
    ],
    "TopLevelIsClosed": [{"notes.txt": "x\n"}, {"scripts/a.sh": "x\n"}, {".gitlab/a.yml": "x\n"}, {"LICENSE": None},
                         {".github/CONTRIBUTING.md": None}],
    "RoomsHaveShortReadmes": [{"deploy/README.md": None}, {"core/README.md": "x\n" * 61}, {"README.md": "x\n" * 151},
                              {"core/index/README.md": "x\n" * 61}],
    "PicturesAreFewAndSmall": [{"deploy/other.png": "x"}, {"core/logo.jpg": "x"},
                               {"deploy/quickstart.png": "x" * (300 * 1024 + 1)}],
    "StatusesReturnByMacro": [source("absl::Status step() {\n" + body + "\n}") for body in (
        "  if (!done.ok()) return done;", "  if (!read.ok()) return read.status();", "  if (!a.ok()) {\n    return a;\n  }",
        "  if (absl::Status status = read(); !status.ok()) return status;", "  if (!a.ok()) return std::move(a).status();")],
    "NothingIsLeftUnfinished": [source("// TO" + "DO: later\n"), {"deploy/run.sh": "# FIX" + "ME\n"},
                                {"proto/README.md": "XX" + "X\n"}],
    "NoPathOfAMachine": [{"deploy/run.sh": "cd /wo" + "rk/main\n"}, {"README.md": "see ../sha" + "red/design\n"},
                         source('const char* path = "/ro' + 'ot/x";\n'), {"tests/run.sh": "/ho" + "me/me/x\n"}],
    "TestsMirrorTheSources": [{"tests/core/geometry/gone_test.cc": "namespace locus {}\n"},
                              {"tests/core/vec3_test.cc": "namespace locus {}\n"}],
    "CommentsBeginWithAVerbOrANoun": [
        source("// Of the last batch.\nint refused();"), source("  // Whether it is there.\nbool a;"),
        source("// The same, once more.\nint b;"), source("int c;\n// Where it stands.\nint d;")],
    "LimitsAreNamedMaxAndMin": [source("constexpr int kMo" + "st = 3;"), source("constexpr int kLe" + "astRows = 3;")],
    "WordsArePlain": [source("// Wakes who" + "ever waits.\nvoid wake();"), {"core/README.md": "Rules of the ho" + "use.\n"}],
    "HardRoomsHavePages": [{"core/GLOSSARY.md": None}, {"server/ARCHITECTURE.md": "x\n" * 61}, {"deploy/NOTES.md": "x\n" * 61}],
    "LinksLeadSomewhere": [{"core/README.md": "See [this](gone.md).\n"}, {"README.md": "[core](core/gone/README.md)\n"}],
    "RoomsUseTheirNamespace": [
        {"server/config/flags.cc": "namespace locus {\n}\n"}, {"core/base/ids.cc": "namespace locus::server {\n}\n"},
        {"core/base/ids.cc": "int global;\n"}, {"client/lib/a.cc": "namespace locus::cli {\n}\n"},
        {"client/cli/a.cc": "namespace game {\n}\n"},
    ],
}

GOOD_SYMBOLS = ["                 U absl::Status::ToString() const", "0000 T locus::grpc_free()", "                 U memcpy"]
BAD_SYMBOLS = ["                 U grpc::Status::OK"]
GOOD_KERNEL = ["0010 T locus::kernels()", "0020 t locus::(anonymous namespace)::trace()", "0030 r .LC1"]
BAD_KERNELS = [[], GOOD_KERNEL + ["0040 W std::min(float, float)"], GOOD_KERNEL + ["0040 V locus::table"],
               GOOD_KERNEL + ["0040 T locus::other()"], GOOD_KERNEL + ["0040 u locus::unique"]]
GOOD_SOURCE = "int twice(int value) { return 2 * value; }\n"
BAD_SOURCE = "int twice( int value ){return 2*value;}\n"
