"""Loop of a game server: each tick it sends one step, the players' moves with queries of what they see after the moves.

    PYTHONPATH=build/release/python /usr/bin/python3 client/python/examples/game_tick.py --address 127.0.0.1:7575

Creates a scene of its own and deletes the scene at the end. Players walk on circles around a wall. Each tick queries
which players are within reach of each player (a ball query), and whether each player sees the next player (a ray
query).
"""
from __future__ import annotations

import argparse
import array
import math
import statistics
import time
from typing import Iterable, List, NamedTuple

import locus

WALL = 1  # id of the wall; the players' ids begin with FIRST
FIRST = 100
RADIUS = 0.5
REACH = 6.0


class Tick(NamedTuple):
    """Results of one tick."""

    revision: int
    in_reach: int
    seen: int
    seconds: float


def positions(players: int, tick: int) -> "array.array[float]":
    """Returns the positions of the players, three float32 each. They walk on three circles around the wall, in both
    directions.
    """
    column = array.array("f")
    for player in range(players):
        distance = 10.0 + 5.0 * (player % 3)
        angle = 2 * math.pi * player / players + (0.02 if player % 2 else -0.02) * tick
        column.extend((distance * math.cos(angle), distance * math.sin(angle), 1.0))
    return column


def shifted(column: "array.array[float]") -> "array.array[float]":
    """Returns for each player the position of the next player."""
    return column[3:] + column[:3]


def difference(a: Iterable[float], b: Iterable[float]) -> "array.array[float]":
    """Returns a - b: the vector from each point of `b` to the point of the same index in `a`."""
    return array.array("f", (x - y for x, y in zip(a, b)))


class Game:
    """Scene of the game, with the stream of its steps."""

    def __init__(self, client: locus.Client, scene: str, players: int) -> None:
        self.ids = array.array("Q", range(FIRST, FIRST + players))
        self.stream = client.query_stream(scene)
        start = locus.UpdateBatch(tick=0)
        start.insert_boxes(WALL, [0.0, 0.0, 2.0], [8.0, 0.25, 2.0])
        start.insert_balls(self.ids, positions(players, 0), RADIUS, groups=self.ids)
        self.stream.step(start, locus.QueryBatch()).result()

    def step(self, number: int) -> Tick:
        """Moves all players and queries at the resulting revision, in one message and one answer."""
        begin = time.perf_counter()
        here = positions(len(self.ids), number)
        batch = locus.QueryBatch()
        batch.balls(here, REACH, block=locus.Block(ignore_groups=self.ids, ignore_ids=[WALL]))
        # Each ray goes from a player to the next player, and ignores the group of the player where it starts. So its
        # first hit is the next player, or an obstacle that hides the next player.
        batch.rays(here, difference(shifted(here), here), t_max=1.0, block=locus.Block(ignore_groups=self.ids))
        step = self.stream.step(locus.UpdateBatch(tick=number).move(self.ids, here), batch).result()
        near, sight = step.result.blocks
        next_ids = self.ids[1:] + self.ids[:1]
        seen = sum(1 for found, wanted in zip(sight.ids.tolist(), next_ids) if found == wanted)
        return Tick(step.ack.revision, near.rows, seen, time.perf_counter() - begin)

    def close(self) -> None:
        """Waits for all answers and closes the stream."""
        self.stream.close()


def run(client: locus.Client, scene: str, players: int, ticks: int, rate: float) -> List[Tick]:
    """Runs `ticks` ticks at `rate` per second. A tick that takes longer than 1 / rate seconds delays the next one."""
    game = Game(client, scene, players)
    done = []
    due = time.perf_counter()
    for number in range(1, ticks + 1):
        done.append(game.step(number))
        due += 1 / rate
        time.sleep(max(0.0, due - time.perf_counter()))
    game.close()
    return done


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--address", default=locus.DEFAULT_ADDRESS)
    parser.add_argument("--scene", default="game-ring")
    parser.add_argument("--players", type=int, default=64)
    parser.add_argument("--ticks", type=int, default=90)
    parser.add_argument("--rate", type=float, default=30.0)
    options = parser.parse_args()
    with locus.connect(options.address) as client:
        client.create_scene(options.scene)
        try:
            ticks = run(client, options.scene, options.players, options.ticks, options.rate)
        finally:
            client.delete_scene(options.scene)
    times = sorted(tick.seconds * 1000 for tick in ticks)
    print(f"ticks             {len(ticks)} of {options.players} players, the last at revision {ticks[-1].revision}")
    print(f"tick, ms          median {statistics.median(times):.2f}, longest {times[-1]:.2f}")
    print(f"late ticks        {sum(1 for tick in times if tick > 1000 / options.rate)}")
    print(f"in reach, a tick  {statistics.mean(tick.in_reach for tick in ticks):.1f}")
    print(f"seen, a tick      {statistics.mean(tick.seen for tick in ticks):.1f}")


if __name__ == "__main__":
    main()
