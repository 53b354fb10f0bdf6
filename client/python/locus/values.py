"""Plain result types: scenes, meshes, acks and so on. Immutable. Each type is made from a message of the protocol."""
from __future__ import annotations

import dataclasses
from typing import Any, Dict, Optional, Tuple

from .enums import Durability, OverloadPolicy, Reason, SceneRole, SceneState, Winding
from .errors import reason_of


@dataclasses.dataclass(frozen=True)
class Revision:
    """Version of a scene. Revision numbers count within `epoch`, which identifies one unbroken sequence of revisions.
    """

    epoch: int
    revision: int


@dataclasses.dataclass(frozen=True)
class ItemError:
    """Item that was refused while the rest of its batch was applied. `field` is the path of the column at fault,
    `index` the index of the item within its list. `message` is the index of the batch within UpdateStream.send_together();
    0 for a single batch.
    """

    field: str
    index: int
    id: int
    reason: Reason
    message: int = 0


@dataclasses.dataclass(frozen=True)
class Ack(Revision):
    """Result of an update batch. A query with `at_least=ack` sees the batch.

    `applied` and `refused` count items; `errors` lists the first 1,000 refused items. `tick` is the scene's tick when
    the batch was applied. `duplicate` is True if the server had already applied this batch and did not apply it again.
    `pending` is True if the server holds the batch until the rest of UpdateStream.send_together(); the stream handles
    such acks itself.
    """

    tick: int
    applied: int
    refused: int
    errors: Tuple[ItemError, ...]
    duplicate: bool
    pending: bool = False

    @classmethod
    def of(cls, message: Any) -> "Ack":
        """Converts the protocol's UpdateAck."""
        errors = tuple(ItemError(error.field, error.index, error.id, reason_of(error.reason), error.message)
                       for error in message.errors)
        return cls(message.epoch, message.revision, message.tick, message.applied, message.refused, errors,
                   message.duplicate, message.pending)


@dataclasses.dataclass(frozen=True)
class Follower:
    """Member of a cluster that follows a scene. `revision` is the revision that it was last known to have, and `age` the
    time in seconds for which it may have missed later revisions.
    """

    address: str
    revision: int
    age: float


@dataclasses.dataclass(frozen=True)
class Placement:
    """Members of a cluster that have the state of a scene. `role` is the role of the server that answered. `leader` is the
    address of the leader, empty if there is none; `followers` are those that the server that answered knows. `token` is
    the number of the leadership: each new leader has a higher one.
    """

    role: SceneRole
    leader: str
    followers: Tuple[Follower, ...]
    token: int

    @classmethod
    def of(cls, message: Any) -> "Placement":
        """Converts the protocol's ScenePlacement."""
        role = message.role if message.role in SceneRole._value2member_map_ else 0
        followers = tuple(Follower(other.address, other.revision, other.age_ms / 1000) for other in message.followers)
        return cls(SceneRole(role), message.leader, followers, message.token)


@dataclasses.dataclass(frozen=True)
class Leadership:
    """Result of Client.move_scene(): the address of the new leader, and the number of its leadership."""

    leader: str
    token: int


@dataclasses.dataclass(frozen=True)
class Scene(Revision):
    """Description of a scene at the time of the call.

    `objects`, `instances` and `triangles` are counts; `memory_bytes` is an estimate that excludes meshes. `bounds` is
    the bounding box of all objects and instances: its lower and its upper corner, each x, y, z in the caller's unit;
    None in an empty scene. The box may be somewhat too large. `history_ticks` is the maximum number of ticks in the
    history. At present the history contains `recorded_ticks` ticks, the first of which is `oldest_tick`, and takes
    `history_bytes` bytes. `forgotten_ticks` ticks were dropped early for lack of memory. `mesh_bytes` is the memory of
    the placed meshes, which scenes share, and `recent_bytes` at most that of recent revisions. `idle_ttl_s` and
    `mesh_grace_s` are those of Client.create_scene(); 0 = never. `cell_size` is 0 if the server chooses it.
    `durability` and `wanted_followers` are the `durability` and `followers` of Client.create_scene(). `placement` names
    the members of a cluster that have the scene; None outside of a cluster. Client.scenes() describes scenes that the
    server does not have by `name`, settings, `epoch` and `placement` only.
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
    mesh_bytes: int = 0
    recent_bytes: int = 0
    forgotten_ticks: int = 0
    idle_ttl_s: int = 0
    mesh_grace_s: int = 0
    cell_size: float = 0
    durability: Durability = Durability.UNSPECIFIED
    wanted_followers: int = 0
    placement: Optional[Placement] = None

    @classmethod
    def of(cls, message: Any) -> "Scene":
        """Converts the protocol's Scene."""
        low, high = message.min, message.max
        bounds = ((low.x, low.y, low.z), (high.x, high.y, high.z)) if message.HasField("min") else None
        state = message.state if message.state in SceneState._value2member_map_ else 0
        durability = message.spec.durability if message.spec.durability in Durability._value2member_map_ else 0
        placement = Placement.of(message.placement) if message.HasField("placement") else None
        return cls(message.epoch, message.revision, message.name, SceneState(state), message.tick, message.objects,
                   message.instances, message.triangles, message.memory_bytes, message.pending_changes,
                   message.last_build_error, dict(message.spec.labels), Winding(message.spec.winding), bounds,
                   message.spec.history_ticks, message.oldest_tick, message.recorded_ticks, message.history_bytes,
                   OverloadPolicy(message.spec.overload), message.mesh_bytes, message.recent_bytes,
                   message.forgotten_ticks, message.spec.idle_ttl_s, message.spec.mesh_grace_s, message.spec.cell_size,
                   Durability(durability), message.spec.followers, placement)


@dataclasses.dataclass(frozen=True)
class MeshPart:
    """Named range of triangles within a mesh, from `first_triangle` up to the next part's first triangle."""

    name: str
    first_triangle: int


@dataclasses.dataclass(frozen=True)
class Mesh:
    """Uploaded mesh. `memory_bytes` is its memory including its tree; `uses` the number of its instances in all scenes.
    """

    name: str
    sha256: bytes
    triangles: int
    zero_area_triangles: int
    memory_bytes: int
    uses: int
    parts: Tuple[MeshPart, ...]

    @classmethod
    def of(cls, message: Any) -> "Mesh":
        """Converts the protocol's Mesh."""
        parts = tuple(MeshPart(part.name, part.first_triangle) for part in message.parts)
        return cls(message.name, message.sha256, message.triangles, message.zero_area_triangles, message.bytes,
                   message.uses, parts)


@dataclasses.dataclass(frozen=True)
class Limit:
    """Limit of the server. `value` is the maximum. `used` is the amount in use now. For some limits of one client or
    scene, such as `calls`, it is the sum over all clients or scenes; for limits of a single request it is 0. `refused`
    is the number of calls, messages and connections that the limit has refused or ended since the server started.
    `used` and `refused` are 0 if Server.use_hidden is True.
    """

    value: float
    used: float
    refused: int


@dataclasses.dataclass(frozen=True)
class Quota:
    """Quota of an identity or connection, and its use. `used` is the amount in use now or, for names that end in
    `_per_s`, the mean rate. `available` is the amount that can be used immediately. `limit` and `available` are None if
    there is no limit.
    """

    limit: Optional[float]
    used: float
    available: Optional[float]

    @classmethod
    def of(cls, message: Any) -> "Quota":
        """Converts the protocol's QuotaUse."""
        limited = message.HasField("limit")
        return cls(message.limit if limited else None, message.used, message.available if limited else None)


@dataclasses.dataclass(frozen=True)
class Member:
    """Living member of a cluster. `id` is chosen at random at each start of the server. `load` decides where new scenes
    are placed. `draining` is True if the member takes no scenes because it shuts down.
    """

    id: int
    address: str
    zone: str
    version: str
    load: int
    draining: bool


@dataclasses.dataclass(frozen=True)
class Cluster:
    """Cluster, as the server that answered knows it. `members` are the living members, ascending by address; `member` is
    the id of the one that answered, 0 if it is none at present because the engine does not answer. `engine` names the
    hosts of the PostgreSQL that stores the scenes, and `engine_answers` is True if it answered the member's last beat.
    The member leads `leading` scenes and follows `following` scenes.
    """

    members: Tuple[Member, ...]
    member: int
    engine: str
    engine_answers: bool
    leading: int
    following: int

    @classmethod
    def of(cls, message: Any) -> "Cluster":
        """Converts the protocol's Cluster."""
        members = tuple(Member(one.id, one.address, one.zone, one.version, one.load, one.draining)
                        for one in message.members)
        return cls(members, message.member, message.engine, message.engine_answers, message.leading, message.following)


@dataclasses.dataclass(frozen=True)
class Server:
    """Description of the server. `limits` maps names to limits. `insecure` is True if the server was started with
    --insecure. `use_hidden` is True if the caller may not see how much of the limits is used. `cluster` is None if the
    server belongs to no cluster.
    """

    version: str
    instruction_set: str
    features: Tuple[str, ...]
    limits: Dict[str, Limit]
    insecure: bool = False
    use_hidden: bool = False
    cluster: Optional[Cluster] = None

    @classmethod
    def of(cls, message: Any) -> "Server":
        """Converts the protocol's GetServerResponse."""
        limits = {limit.name: Limit(limit.value, limit.used, limit.refused) for limit in message.limits}
        return cls(message.version, message.instruction_set, tuple(message.features), limits,
                   message.insecure, message.use_hidden,
                   Cluster.of(message.cluster) if message.HasField("cluster") else None)


@dataclasses.dataclass(frozen=True)
class Work:
    """Work of a batch or a block: numbers of visited tree nodes (`nodes`) and grid cells (`cells`) and of tested
    triangles and objects (`tests`), and the time summed over all threads.
    """

    nodes: int
    cells: int
    tests: int
    nanoseconds: int

    @classmethod
    def of(cls, message: Any) -> "Work":
        """Converts the protocol's Work."""
        return cls(message.nodes, message.cells, message.tests, message.nanoseconds)
