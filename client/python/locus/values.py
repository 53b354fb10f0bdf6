"""Plain answers: scenes, meshes, acks and the like. Immutable; each is made from the protocol's message of that name."""
from __future__ import annotations

import dataclasses
from typing import Any, Dict, Optional, Tuple

from .enums import OverloadPolicy, Reason, SceneState, Winding
from .errors import reason_of


@dataclasses.dataclass(frozen=True)
class Revision:
    """A moment of a scene. Revisions count within an epoch; a scene that started over has another epoch."""

    epoch: int
    revision: int


@dataclasses.dataclass(frozen=True)
class ItemError:
    """One item of a batch that was refused while the rest was applied: `field` is the column, `index` the entry in it."""

    field: str
    index: int
    id: int
    reason: Reason


@dataclasses.dataclass(frozen=True)
class Ack(Revision):
    """What became of an update batch. A query with `at_least=ack` sees it.

    `applied` and `refused` count items; `errors` has the first 1,000 refused ones. `tick` is the tick it was applied
    under. `duplicate`: this writer's batch had been applied before and was not applied again.
    """

    tick: int
    applied: int
    refused: int
    errors: Tuple[ItemError, ...]
    duplicate: bool

    @classmethod
    def of(cls, message: Any) -> "Ack":
        """From the protocol's UpdateAck."""
        errors = tuple(ItemError(error.field, error.index, error.id, reason_of(error.reason)) for error in message.errors)
        return cls(message.epoch, message.revision, message.tick, message.applied, message.refused, errors,
                   message.duplicate)


@dataclasses.dataclass(frozen=True)
class Scene(Revision):
    """A scene as it was when it was asked for.

    `objects`, `instances` and `triangles` are counts, `memory_bytes` an estimate without meshes. `bounds` holds the
    lower and upper corner, each x, y, z in the caller's unit, possibly somewhat too wide; None in an empty scene.
    Of a past of at most `history_ticks` ticks, `recorded_ticks` from `oldest_tick` on are kept, in `history_bytes`.
    """

    name: str
    state: SceneState
    tick: int
    objects: int
    instances: int
    triangles: int
    memory_bytes: int
    pending_changes: int
    last_build_error: str
    labels: Dict[str, str]
    winding: Winding
    bounds: Optional[Tuple[Tuple[float, float, float], Tuple[float, float, float]]]
    history_ticks: int = 0
    oldest_tick: int = 0
    recorded_ticks: int = 0
    history_bytes: int = 0
    overload: OverloadPolicy = OverloadPolicy.UNSPECIFIED

    @classmethod
    def of(cls, message: Any) -> "Scene":
        """From the protocol's Scene."""
        low, high = message.min, message.max
        bounds = ((low.x, low.y, low.z), (high.x, high.y, high.z)) if message.HasField("min") else None
        state = message.state if message.state in SceneState._value2member_map_ else 0
        return cls(message.epoch, message.revision, message.name, SceneState(state), message.tick, message.objects,
                   message.instances, message.triangles, message.memory_bytes, message.pending_changes,
                   message.last_build_error, dict(message.spec.labels), Winding(message.spec.winding), bounds,
                   message.spec.history_ticks, message.oldest_tick, message.recorded_ticks, message.history_bytes,
                   OverloadPolicy(message.spec.overload))


@dataclasses.dataclass(frozen=True)
class MeshPart:
    """A named run of triangles within a mesh, from `first_triangle` to where the next part begins."""

    name: str
    first_triangle: int


@dataclasses.dataclass(frozen=True)
class Mesh:
    """An uploaded mesh. `memory_bytes` is what it takes, its tree included; `uses` the number of its instances in all scenes."""

    name: str
    sha256: bytes
    triangles: int
    zero_area_triangles: int
    memory_bytes: int
    uses: int
    parts: Tuple[MeshPart, ...]

    @classmethod
    def of(cls, message: Any) -> "Mesh":
        """From the protocol's Mesh."""
        parts = tuple(MeshPart(part.name, part.first_triangle) for part in message.parts)
        return cls(message.name, message.sha256, message.triangles, message.zero_area_triangles, message.bytes,
                   message.uses, parts)


@dataclasses.dataclass(frozen=True)
class Limit:
    """A maximum of the server; `used` is how much is in use now, 0 for limits of one request or scene."""

    value: float
    used: float


@dataclasses.dataclass(frozen=True)
class Server:
    """The server's description of itself; `limits` by name."""

    version: str
    instruction_set: str
    features: Tuple[str, ...]
    limits: Dict[str, Limit]

    @classmethod
    def of(cls, message: Any) -> "Server":
        """From the protocol's GetServerResponse."""
        limits = {limit.name: Limit(limit.value, limit.used) for limit in message.limits}
        return cls(message.version, message.instruction_set, tuple(message.features), limits)


@dataclasses.dataclass(frozen=True)
class Work:
    """How much a query took: nodes and cells visited, triangles and objects tested, time of all threads together."""

    nodes: int
    cells: int
    tests: int
    nanoseconds: int

    @classmethod
    def of(cls, message: Any) -> "Work":
        """From the protocol's Work."""
        return cls(message.nodes, message.cells, message.tests, message.nanoseconds)
