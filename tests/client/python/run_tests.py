"""Runs one test file of the Python package: run_tests.py FILE --package DIR --bin DIR --protoc PROGRAM [--without-numpy]
[--embedded].

It tests the built package. With --without-numpy, importing numpy fails even if it is installed; without this option,
every test fails if numpy is not installed. With --embedded, tests of DaemonTest get their locusd from locus.embedded().
"""
import argparse
import importlib.util
import os
import sys
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))


def options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    for name in ("package", "bin", "protoc"):
        parser.add_argument("--" + name, required=True)
    parser.add_argument("--without-numpy", action="store_true")
    parser.add_argument("--embedded", action="store_true")
    return parser.parse_args()


def main():
    chosen = options()
    sys.dont_write_bytecode = True
    sys.path[:0] = [chosen.package, HERE, os.path.join(HERE, "../../../client/python")]
    os.environ.update(LOCUS_PACKAGE=chosen.package, LOCUS_BIN=chosen.bin, LOCUS_PROTOC=chosen.protoc,
                      LOCUS_EMBEDDED="1" if chosen.embedded else "")
    if chosen.without_numpy:
        sys.modules["numpy"] = None
    else:
        import numpy  # noqa: F401  fails here with a clear error instead of skipping tests
    spec = importlib.util.spec_from_file_location("tests", chosen.file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    unittest.main(module, argv=sys.argv[:1], verbosity=2)


if __name__ == "__main__":
    main()
