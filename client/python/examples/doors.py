"""Doors that open and close, and shots that are judged at the time at which the shooter saw the world.

    PYTHONPATH=build/release/python /usr/bin/python3 doors.py [ADDRESS]

A door is an instance of a mesh. Each tick moves the doors with the players, in one batch and at one revision. The scene
keeps its past ticks, so the server of a game can rewind a shot by the latency of the shooter: a door that was closed at
that time stops the shot, even if it is open now.
"""
from __future__ import annotations

import sys

import locus

SCENE, MESH = "doors-example", "doors-example-door"
DOOR, PLAYER = 1, 100
OPENS, CLOSES, END = 4, 12, 16  # the door begins to open at tick OPENS, and to close at tick CLOSES
WIDTH, STEPS = 2.0, 4  # the door slides by its width in this number of ticks
# A door panel: a rectangle in the plane y = 0, from x = 0 to 2 and from z = 0 to 3.
PANEL = ([0, 0, 0, 2, 0, 0, 2, 0, 3, 0, 0, 3], [0, 1, 2, 0, 2, 3])


def offset(tick: int) -> float:
    """Returns how far the door is open at the end of a tick."""
    moved = min(max(tick - OPENS + 1, 0), STEPS) - min(max(tick - CLOSES + 1, 0), STEPS)
    return WIDTH * moved / STEPS


def make_scene(client: locus.Client) -> None:
    """Creates the scene with a closed door and a player who stands behind it."""
    client.delete_scene(SCENE, if_present=True)
    client.create_scene(SCENE, history_ticks=60)
    client.upload_mesh(MESH, *PANEL)
    client.change_instances(SCENE, locus.InstanceChange().place(MESH, [0.0, 0.0, 0.0], ids=DOOR))
    player = locus.UpdateBatch(tick=1).insert_capsules(PLAYER, [1.0, 5.0, 1.0], [0, 0, 0.5], 0.4)
    client.apply(SCENE, player)


def play(client: locus.Client) -> locus.Ack:
    """Runs all ticks; returns the ack of the last one."""
    for tick in range(2, END + 1):
        batch = locus.UpdateBatch(tick=tick)
        batch.move_instances(DOOR, positions_f64=[offset(tick), 0.0, 0.0])
        batch.move(PLAYER, [1.0, 5.0 + 0.1 * tick, 1.0])
        ack = client.apply(SCENE, batch)
    return ack


def shoot(client: locus.Client, ack: locus.Ack, times: list[tuple[int, float]]) -> list[int]:
    """Fires one shot at the player for each time (tick and fraction); returns the ids of what the shots hit."""
    block = locus.Block(as_of_ticks=[tick for tick, _ in times], as_of_fractions=[fraction for _, fraction in times])
    batch = locus.QueryBatch(at_least=ack).rays([[1.0, -5.0, 1.0]] * len(times), [0.0, 1.0, 0.0], block=block)
    (result,) = client.query(SCENE, batch).blocks
    return list(result.ids)


def main() -> None:
    times = [(2, 0.0), (OPENS, 0.5), (OPENS + 1, 0.5), (9, 0.0), (CLOSES + 1, 0.25), (END, 0.0)]
    names = {DOOR: "stopped by the door", PLAYER: "hits the player"}
    with locus.connect(sys.argv[1] if len(sys.argv) > 1 else locus.DEFAULT_ADDRESS) as client:
        make_scene(client)
        hits = shoot(client, play(client), times)
        for (tick, fraction), hit in zip(times, hits):
            print(f"a shot at tick {tick + fraction}: {names[hit]}")
        client.delete_scene(SCENE)
        client.delete_mesh(MESH)


if __name__ == "__main__":
    main()
