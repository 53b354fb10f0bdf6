"""Attacks a locusd over loopback and measures an honest client, the victim. README.md has the table of attacks.

    python3 attack.py --attack quick --locusd build/release/bin/locusd
    python3 attack.py --attack gzip,unread --limit 512MiB,2GiB --seconds 5 --locusd build/release/bin/locusd

Exits 0 if no row failed, 1 if a row failed, 77 if nothing could be run; the reason is printed.
"""
import argparse
import json
import os
import re
import signal
import sys
import time

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import report  # noqa: E402
import runner  # noqa: E402
import table  # noqa: E402
from daemon import Unsupported  # noqa: E402
from job import STRANGER  # noqa: E402

SKIPPED = 77
FRONTS = ("plain", "tls", "mtls", STRANGER, "edge")


def size(text):
    """Returns the number of bytes of a size such as 512MiB."""
    found = re.fullmatch(r"(\d+)(MiB|GiB)", text)
    if not found:
        raise argparse.ArgumentTypeError(f"{text} is no size such as 512MiB or 2GiB")
    return int(found.group(1)) << (20 if found.group(2) == "MiB" else 30)


def sizes(text):
    return [size(part) for part in text.split(",")]


def options():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--attack", default="quick", help="names with commas, all, quick, or quick:GROUP")
    parser.add_argument("--limit", type=sizes, default=[1 << 30], help="memory of the daemon, such as 512MiB,1GiB")
    parser.add_argument("--front", choices=FRONTS, default="plain",
                        help="how to reach the daemon; README.md says what each is")
    parser.add_argument("--seconds", type=float, default=None, help="duration of each step; 1 in the quick form, else 3")
    parser.add_argument("--locusd", default="build/release/bin/locusd", help="the program to start")
    parser.add_argument("--address", help="with --front edge: HOST:PORT of a front that runs already")
    parser.add_argument("--pid", type=int, help="with --address: process of the daemon to watch")
    parser.add_argument("--ca", help="with --front edge: certificate of the authority, if the front is encrypted")
    parser.add_argument("--json", help="file to write the results to")
    parser.add_argument("--list", action="store_true", help="print the attacks and do nothing")
    chosen = parser.parse_args()
    if bool(chosen.address) != bool(chosen.pid) or chosen.address and chosen.front != "edge":
        parser.error("--address and --pid go together, with --front edge")
    return chosen


def list_attacks():
    for attack in table.ROWS:
        print(f"{attack.name:17} {attack.group:12} {attack.what}; {attack.bound}")


def run_rows(chosen, attacks, quick):
    """Runs the attacks with each limit and prints each row when it ends. Returns the values of the rows."""
    rows, seconds = [], chosen.seconds or (1.0 if quick else 3.0)
    for limit in chosen.limit:
        setup = runner.Options(chosen.locusd, limit, chosen.front, seconds, quick, chosen.address, chosen.pid,
                               chosen.ca)
        for attack in attacks:
            began = time.monotonic()
            rows.append(report.values(runner.run(attack, setup), quick))
            print(f"{report.mib(limit)}MiB {attack.name}: {rows[-1]['verdict']}, {rows[-1]['steps']} steps, "
                  f"{time.monotonic() - began:.1f} s", flush=True)
            if chosen.json:
                with open(chosen.json, "w", encoding="utf-8") as file:
                    json.dump(rows, file, indent=1)
    return rows


def main():
    chosen = options()
    if chosen.list:
        list_attacks()
        return 0
    try:
        attacks, quick, left_out = table.chosen(chosen.attack, chosen.front)
    except ValueError as error:
        print(f"attack.py: {error}", file=sys.stderr)
        return 2
    for name in left_out:
        print(f"skipped: {name}: not survived yet: {table.NOT_YET[name]}")
    if not attacks:
        return SKIPPED
    try:
        rows = run_rows(chosen, attacks, quick)
    except Unsupported as error:
        print(f"skipped: front {chosen.front}: {error}")
        return SKIPPED
    print(f"\nlimited by: {', '.join(sorted({row['limited_by'] for row in rows}))}; front {chosen.front}")
    print("\n".join(report.table(rows) + [line for row in rows for line in report.remarks(row)]))
    failed = sum(bool(row["failures"]) for row in rows)
    print(f"{len(rows) - failed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    sys.exit(main())
