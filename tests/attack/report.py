"""The table of results, as text and as JSON. Both are made from the dictionary that values() makes from a Row."""

HEAD = ("limit", "attack", "verdict", "deaths", "p99x", "idle_p99_ms", "p99_ms", "new_p99_ms", "victim_errors", "peak_MiB",
        "before_MiB", "after_MiB", "most_fds", "fds_kept", "threads", "load", "codes")


def mib(size):
    return f"{size / (1 << 20):.0f}"


def verdict(row, quick):
    """Returns one word: `ok`, `killed`, `hangs` (victim or attack), `wrong` (status codes), `holds` (memory or
    descriptors were not returned) or `slow`.
    """
    if row.deaths:
        return "killed"
    if not row.served or row.stuck:
        return "hangs"
    if row.wrong:
        return "wrong"
    if not row.returned():
        return "holds"
    return "slow" if row.failures(quick) else "ok"


def values(row, quick):
    """Returns a row as values that JSON can encode."""
    return {"attack": row.attack.name, "group": row.attack.group, "limit": row.limit, "limited_by": row.kind,
            "verdict": verdict(row, quick), "failures": row.failures(quick), "skipped": row.skipped, "deaths": row.deaths,
            "steps": row.steps, "p99_ratio": row.slower(), "idle": row.idle, "during": row.during, "served": row.served,
            "peak": row.peak, "before": row.before, "after": row.after, "threads": row.threads, "load": row.load,
            "descriptors": [row.descriptors, row.most_descriptors, row.descriptors_after], "codes": dict(row.codes)}


def cells(row):
    """Returns the cells of a row as texts, in the order of HEAD."""
    idle, during, (before, most, after) = row["idle"], row["during"], row["descriptors"]
    times = [f"{row['p99_ratio']:.1f}"] + [f"{span.get(name, 0):.1f}" for span, name in (
        (idle, "p99_ms"), (during, "p99_ms"), (during, "connect_p99_ms"))]
    return [mib(row["limit"]) + "MiB", row["attack"], row["verdict"], f"{len(row['deaths'])}/{row['steps']}", *times,
            str(sum(during.get("errors", {}).values())), mib(row["peak"]), mib(row["before"]), mib(row["after"]), str(most),
            str(max(after - before, 0)), str(row["threads"]), f"{row['load']:.1f}",
            " ".join(f"{code}:{number}" for code, number in sorted(row["codes"].items())) or "-"]


def table(rows):
    """Returns the lines of a table whose columns are aligned."""
    lines = [list(HEAD)] + [cells(row) for row in rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(HEAD))]
    return ["  ".join(cell.ljust(width) for cell, width in zip(line, widths)).rstrip() for line in lines]


def remarks(row):
    """Returns lines that name the failures and the skipped steps of a row."""
    name = f"{mib(row['limit'])}MiB {row['attack']}"
    return [f"{name}: FAILED: {text}" for text in row["failures"]] + [f"{name}: skipped: {text}" for text in row["skipped"]]
