"""Keeps HAProxy's map from scenes to daemons up to date: reads every second from the engine which daemon leads which scene,
and changes the map in the running proxy at once if it differs. If the engine is away, the map stays as it is.

    python3 update_map.py --cluster postgresql://locus@engine-1,engine-2,engine-3/locus?passfile=FILE --socket SOCKET
        --map FILE [--once]

SOCKET is that of HAProxy's command line, FILE the name of the map in haproxy.cfg. --once ends after the first change.
"""
import argparse
import re
import socket
import sys
import time

import psycopg2

LEADERS = ("SELECT s.name, m.address FROM locus.scene s JOIN locus.scene_log l ON l.scene = s.key "
           "JOIN locus.member m ON m.id = l.leader WHERE m.dead = 0")
SECONDS_BETWEEN = 1.0
ENGINE_SECONDS = 5
SOCKET_SECONDS = 10
LINES_A_COMMAND = 200


class ProxyError(Exception):
    """HAProxy refused a command."""


def command(path, text):
    """Sends one command to HAProxy. Returns its answer."""
    with socket.socket(socket.AF_UNIX) as connection:
        connection.settimeout(SOCKET_SECONDS)
        connection.connect(path)
        connection.sendall(text.encode() + b"\n")
        connection.shutdown(socket.SHUT_WR)
        answer = b""
        while data := connection.recv(1 << 16):
            answer += data
    return answer.decode().strip()


def current(path, name):
    """Returns the map that the proxy uses. Its lines are: address of the entry, key, value."""
    lines = (line.split(maxsplit=2) for line in command(path, f"show map {name}").splitlines())
    return {line[1]: line[2] for line in lines if len(line) == 3}


def replace(path, name, leaders):
    """Replaces the proxy's map in one step, so that no call sees a part of it."""
    version = re.search(r"\d+", command(path, f"prepare map {name}"))
    if version is None:
        raise ProxyError(f"it has no map {name}")
    lines = [f"{scene} {address}" for scene, address in sorted(leaders.items())]
    for first in range(0, len(lines), LINES_A_COMMAND):
        answer = command(path, f"add map @{version[0]} {name} <<\n" + "\n".join(lines[first:first + LINES_A_COMMAND]) + "\n")
        if answer:
            raise ProxyError(answer)
    answer = command(path, f"commit map @{version[0]} {name}")
    if answer:
        raise ProxyError(answer)


def connect(cluster):
    """Connects to the node of the engine that takes writes."""
    connection = psycopg2.connect(cluster, target_session_attrs="read-write", connect_timeout=ENGINE_SECONDS,
                                  options=f"-c statement_timeout={ENGINE_SECONDS}s", tcp_user_timeout=ENGINE_SECONDS * 1000)
    connection.autocommit = True
    return connection


def leaders_in(connection):
    with connection.cursor() as cursor:
        cursor.execute(LEADERS)
        return dict(cursor.fetchall())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cluster", required=True)
    parser.add_argument("--socket", required=True)
    parser.add_argument("--map", required=True)
    parser.add_argument("--once", action="store_true")
    options = parser.parse_args()
    connection, said = None, None
    while True:
        trouble = None
        try:
            connection = connection or connect(options.cluster)
            leaders = leaders_in(connection)
            if leaders != current(options.socket, options.map):
                replace(options.socket, options.map, leaders)
                print(f"update_map: {len(leaders)} scenes", file=sys.stderr, flush=True)
                if options.once:
                    return
        except (psycopg2.Error, OSError, ProxyError) as error:
            trouble = str(error).strip()
            if isinstance(error, psycopg2.Error):
                connection = None
        if trouble and trouble != said:
            print(f"update_map: the map stays as it is: {trouble}", file=sys.stderr, flush=True)
        said = trouble
        time.sleep(SECONDS_BETWEEN)


if __name__ == "__main__":
    main()
