"""What a client of a cluster knows: which server leads or follows each scene, which servers have just failed, and the
highest revision that was seen of each scene. Internal to the package; makes no call.

Invariants: of two answers about the leader of a scene, the one with the higher token is kept, as long as its server
answers. The number of scenes and of addresses that are kept is bounded.
"""
from __future__ import annotations

import dataclasses
import enum
import random
import threading
import time
from typing import Callable, Dict, List, Optional, Sequence, Tuple, TypeVar

from .connection import target_of
from .values import Placement, Revision

_FAILED_SECONDS = 1.0  # time for which a server that failed is asked only if there is no other
_READERS_SECONDS = 10.0  # time after which the followers of a scene are asked for again
_READERS_AGAIN_SECONDS = 2.0  # the same after an attempt that failed
_MAX_SCENES = 10_000
_MAX_LEARNED = 64  # maximum number of addresses that errors have named


_Known = TypeVar("_Known")


class ReadFrom(enum.Enum):
    """Servers of a cluster that answer the queries of a client.

    With each of them, the revisions that a client sees of a scene never decrease, and a query sees every update that the
    client was acknowledged before.
    """

    # The leader of the scene: a query also sees every update that other clients were acknowledged before it was sent.
    # Queries wait while no server leads the scene.
    LEADER = "leader"
    # The leader or a follower, chosen at random for each scene and kept while it answers. Queries continue while no server
    # leads the scene.
    ANY = "any"
    # A follower, chosen likewise, so that the leader has time for updates; the leader if the scene has no follower.
    FOLLOWER = "follower"


@dataclasses.dataclass
class _Leader:
    """Server that leads a scene. Until `paused_until`, other servers are asked first."""

    address: str
    token: int
    paused_until: float = 0.0


@dataclasses.dataclass
class _Readers:
    """Servers that may answer queries about a scene, and the one that was chosen."""

    addresses: Tuple[str, ...]
    chosen: str
    read_again_at: float


class Routes:
    """Thread-safe. `addresses` are the targets that the user gave."""

    def __init__(self, addresses: Sequence[str], clock: Callable[[], float] = time.monotonic) -> None:
        self.given = tuple(dict.fromkeys(addresses))
        self._clock = clock
        self._lock = threading.Lock()
        self._learned: List[str] = []
        self._current = 0  # index of the server that is asked about a scene whose leader is not known
        self._failed: Dict[str, float] = {}  # address -> time until which it is avoided
        self._leaders: Dict[str, _Leader] = {}
        self._readers: Dict[str, _Readers] = {}
        self._floors: Dict[str, Revision] = {}

    @property
    def addresses(self) -> Tuple[str, ...]:
        """The given addresses, then those that servers have named."""
        with self._lock:
            return (*self.given, *self._learned)

    def next(self, scene: str = "") -> str:
        """Returns the address to call next about a scene: its leader or, if that is not known or has failed, another
        server, which names the leader.
        """
        with self._lock:
            now = self._clock()
            leader = self._leaders.get(scene)
            if leader is not None and leader.paused_until <= now and not self._has_failed(leader.address, now):
                return leader.address
            every = [*self.given, *self._learned]
            order = every[self._current:] + every[:self._current]
            if leader is not None and len(order) > 1:
                order = [address for address in order if address != leader.address]
            usable = [address for address in order if not self._has_failed(address, now)]
            return usable[0] if usable else min(order, key=lambda address: self._failed[address])

    def would_answer(self, address: str) -> bool:
        """Returns False if the server has just failed."""
        with self._lock:
            return not self._has_failed(address, self._clock())

    def answered(self, address: str) -> None:
        """Notes that a server answers."""
        if self._failed:
            with self._lock:
                self._failed.pop(address, None)

    def failed(self, address: str) -> None:
        """Notes that a server cannot be reached, starts or shuts down."""
        with self._lock:
            self._failed[address] = self._clock() + _FAILED_SECONDS
            self._move_on_from(address)

    def has_no_leader(self, scene: str, address: str, seconds: float) -> None:
        """Notes that the server at `address` does not lead the scene for the next `seconds`, although it may be said to."""
        with self._lock:
            leader = self._leaders.get(scene)
            if leader is not None and leader.address == address:
                leader.paused_until = self._clock() + max(seconds, 0.05)
            self._move_on_from(address)

    def elsewhere(self, scene: str, teller: str, addresses: Sequence[str], token: int) -> None:
        """Notes the leader of a scene, as the server at `teller` named it: `addresses[0]`, with the token of its leadership.

        An answer with an older token is ignored, unless the leader that is known has failed or is the teller itself: then
        the scene may have been deleted and created anew, with tokens from 1.
        """
        if not addresses or not addresses[0]:
            return
        with self._lock:
            known = self._leaders.get(scene)
            stale = (known is not None and token < known.token and known.address != teller
                     and not self._has_failed(known.address, self._clock()))
            if not stale:
                leader = target_of(addresses[0])
                self._keep_bounded(self._leaders, scene)
                self._leaders[scene] = _Leader(leader, token)
                self._learn(leader)

    def forget(self, scene: str) -> None:
        """Forgets everything about a scene, which was deleted."""
        with self._lock:
            self._leaders.pop(scene, None)
            self._readers.pop(scene, None)
            self._floors.pop(scene, None)

    def forget_readers(self, scene: str) -> None:
        """Lets the followers of a scene be asked for again."""
        with self._lock:
            self._readers.pop(scene, None)

    def forget_leader(self, scene: str) -> None:
        """Forgets who leads a scene, which a server does not know."""
        with self._lock:
            self._leaders.pop(scene, None)

    def reader(self, scene: str) -> Optional[str]:
        """Returns the address that was chosen for queries about a scene, or another of its readers if that has failed.
        Returns None if there is none, or if the followers must be asked for again.
        """
        with self._lock:
            readers = self._readers.get(scene)
            now = self._clock()
            if readers is None or readers.read_again_at <= now:
                return None
            if self._has_failed(readers.chosen, now):
                usable = [address for address in readers.addresses if not self._has_failed(address, now)]
                if usable:
                    readers.chosen = random.choice(usable)
            return readers.chosen

    def set_readers(self, scene: str, placement: Optional[Placement], read_from: ReadFrom) -> None:
        """Chooses the server for queries about a scene, among those of its placement. `placement`: None if the leader did
        not answer; then the readers stay what they are.
        """
        with self._lock:
            old, now = self._readers.get(scene), self._clock()
            addresses = old.addresses if old is not None else ()
            if placement is not None:
                leader = (target_of(placement.leader),) if placement.leader else ()
                followers = tuple(target_of(follower.address) for follower in placement.followers if follower.address)
                addresses = followers or leader if read_from is ReadFrom.FOLLOWER else leader + followers
            chosen = old.chosen if old is not None and old.chosen in addresses else ""
            if not chosen and addresses:
                chosen = random.choice(addresses)
            wait = _READERS_SECONDS if placement is not None else _READERS_AGAIN_SECONDS
            self._keep_bounded(self._readers, scene)
            self._readers[scene] = _Readers(addresses, chosen, now + wait)

    def floor(self, scene: str) -> Optional[Revision]:
        """Returns the highest revision that was seen of a scene."""
        with self._lock:
            return self._floors.get(scene)

    def saw(self, scene: str, epoch: int, revision: int, from_leader: bool) -> None:
        """Notes a revision that was seen. Only the leader can show that a scene has another epoch than the one known."""
        with self._lock:
            floor = self._floors.get(scene)
            if floor is None or (revision > floor.revision if epoch == floor.epoch else from_leader):
                self._keep_bounded(self._floors, scene)
                self._floors[scene] = Revision(epoch, revision)

    def _has_failed(self, address: str, now: float) -> bool:
        return self._failed.get(address, 0.0) > now

    def _move_on_from(self, address: str) -> None:
        every = [*self.given, *self._learned]
        if every[self._current] == address:
            self._current = (self._current + 1) % len(every)

    def _learn(self, address: str) -> None:
        if address in self.given or address in self._learned:
            return
        if len(self._learned) >= _MAX_LEARNED:
            self._failed.pop(self._learned.pop(0), None)
            self._current = 0
        self._learned.append(address)

    @staticmethod
    def _keep_bounded(known: Dict[str, _Known], scene: str) -> None:
        if len(known) >= _MAX_SCENES and scene not in known:
            del known[next(iter(known))]
