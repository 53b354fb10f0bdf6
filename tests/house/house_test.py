"""The repository rules, each a test of its own.

    house_test.py --list                          names of the rules
    house_test.py --root . [--build DIR] [RULE]   checks one rule or all rules; exits 0 if all hold, 77 if skipped
    house_test.py --sizes                         lengths of files and functions

Before a rule checks the tree, it runs on examples that break the rule and on examples that keep it (examples.py). If
the rule does not detect a broken example, or refuses a good one, its test fails.
"""
import argparse
import os
import sys

sys.dont_write_bytecode = True

import include_rules
import language_rules
import python_rules
import shape_rules
import tool_rules
from examples import (BAD_EXAMPLES, BAD_KERNELS, BAD_SOURCE, BAD_SYMBOLS, GOOD_EXAMPLE, GOOD_KERNEL, GOOD_SOURCE,
                      GOOD_SYMBOLS)
from source_tree import Tree, read_tree

SKIPPED = 77
TREE_RULES = {**include_rules.RULES, **shape_rules.RULES, **language_rules.RULES, **python_rules.RULES}


def failures_of_the_rule_itself(name, rule):
    """Returns defects of a rule: examples that break the rule but pass, and problems found in the good example."""
    problems = [f"the rule refuses a good example: {problem}" for problem in rule(Tree(GOOD_EXAMPLE))]
    examples = BAD_EXAMPLES.get(name, [])
    if not examples:
        problems.append("the rule has no example that breaks it")
    for number, example in enumerate(examples):
        files = {path: text for path, text in {**GOOD_EXAMPLE, **example}.items() if text is not None}
        if not rule(Tree(files)):
            problems.append(f"the rule does not see its bad example {number}: {sorted(example)}")
    return problems


def check_tree_rule(name, options):
    return failures_of_the_rule_itself(name, TREE_RULES[name]) + TREE_RULES[name](read_tree(options.root))


def check_symbols(options):
    problems = [] if tool_rules.symbols_of_other_worlds(BAD_SYMBOLS) else ["the rule does not see its bad example"]
    problems += [f"the rule refuses {name}" for name in tool_rules.symbols_of_other_worlds(GOOD_SYMBOLS)]
    return problems + tool_rules.pure_libraries_refer_to_no_grpc(None, options.build)


def check_kernels(options):
    problems = ["the rule does not see its bad example" for bad in BAD_KERNELS if not tool_rules.faults_of_a_kernel(bad)]
    problems += [f"the rule refuses a good example: {fault}" for fault in tool_rules.faults_of_a_kernel(GOOD_KERNEL)]
    return problems + tool_rules.kernels_export_one_symbol(options.build)


def check_format(options):
    problems = [] if tool_rules.is_formatted(GOOD_SOURCE, options.root) else ["the rule refuses a formatted example"]
    problems += ["the rule does not see its bad example"] if tool_rules.is_formatted(BAD_SOURCE, options.root) else []
    return problems + tool_rules.sources_are_formatted(read_tree(options.root), options.root)


def check_exceptions(options):
    """Returns a problem for each test in MIRROR_EXCEPTIONS (shape_rules.py) that no longer exists, and the defects of
    this rule itself.
    """
    problems = [] if shape_rules.stale_exceptions(Tree(GOOD_EXAMPLE)) else ["the rule does not see its bad example"]
    return problems + shape_rules.stale_exceptions(read_tree(options.root))


OTHER_RULES = {
    "PureLibrariesReferToNoGrpc": check_symbols,
    "KernelsExportOneSymbol": check_kernels,
    "SourcesAreFormatted": check_format,
    "ExceptionsOfTheMirrorExist": check_exceptions,
}


def run(name, options):
    """Prints the findings of one rule and returns its exit status."""
    try:
        check = OTHER_RULES.get(name)
        problems = check(options) if check else check_tree_rule(name, options)
    except tool_rules.Skip as reason:
        print(f"SKIPPED {name}: {reason}")
        return SKIPPED
    for problem in problems:
        print(problem)
    print(f"{'FAILED' if problems else 'ok'} {name}")
    return 1 if problems else 0


def main():
    names = [*TREE_RULES, *OTHER_RULES]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", default=os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
    parser.add_argument("--build", help="build folder whose libraries are looked into")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--sizes", action="store_true")
    parser.add_argument("rule", nargs="?", choices=names)
    options = parser.parse_args()
    if options.list:
        print("\n".join(names))
        return 0
    if options.sizes:
        print("\n".join(shape_rules.sizes(read_tree(options.root))))
        return 0
    results = [run(name, options) for name in ([options.rule] if options.rule else names)]
    return 1 if 1 in results else SKIPPED if results == [SKIPPED] else 0


if __name__ == "__main__":
    sys.exit(main())
