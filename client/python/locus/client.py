"""Entry point of the package: a connection to one locusd, its calls, and the streams opened from it.

    import locus

    with locus.connect("127.0.0.1:7575") as client:
        result = client.query("arena", locus.QueryBatch().rays([0, 0, 100], [0, 0, -1]))
        print(result.blocks[0].t, result.blocks[0].ids)

Calls block. Errors are LocusError (locus/errors.py); wrong arguments are TypeError and ValueError. Unary calls that
change nothing are retried within their timeout, as often as `retry` of connect() allows, if the server is unavailable
or asks for a wait. apply() is retried only if its batch carries `writer` and `number`. Other calls are never retried,
with one exception: if the server refuses the token of a unary call, and the token file then contains a new token, the
call is repeated with the new token.

With several addresses, connect() returns the client of a cluster. It sends each call to the server that leads the scene,
which other servers name, and goes to the next server when one fails. A call that a server refused because another one
leads the scene, or because it shuts down, has changed nothing and is repeated, whatever it is. The revisions that a client
sees of a scene never decrease: queries that name no revision wait for the highest one that it has seen.
"""
from __future__ import annotations

import dataclasses
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Union

import grpc

from . import columns, meshes, schema, wire
from .cluster import ClusterConnection
from .connection import Connection, Retry
from .credentials import Credentials
from .enums import Durability, OverloadPolicy, Winding
from .errors import LocusError, late_query, parsed
from .meshes import InstanceChange, MeshColumns, PlacedInstances
from .queries import QueryBatch, names_revision
from .query_stream import QueryStream
from .results import QueryResult, StepResult
from .routes import ReadFrom
from .update_stream import UpdateStream
from .updates import UpdateBatch
from .values import Ack, Leadership, Mesh, MeshPart, Quota, Scene, Server

DEFAULT_ADDRESS = "127.0.0.1:7575"
_HEALTH = schema.method("grpc.health.v1.Health", "Check")
_SERVING = 1
_TIMEOUT, _CLUSTER_TIMEOUT = 10.0, 30.0
_RECONNECT = Retry(attempts=10)
# Long enough for another server of a cluster to take over the scenes of one that was lost, which takes about 8 s.
_CLUSTER_RETRY = Retry(attempts=45, max_wait=0.5)


def _rpc(service: str, name: str) -> schema.Method:
    return schema.method(f"locus.v1.{service}Service", name)


_QUERY = _rpc("Query", "Query")


def connect(address: Union[str, Sequence[str]] = DEFAULT_ADDRESS, *, timeout: Optional[float] = None,
            long_timeout: float = 600.0, wait_for_server: bool = False, max_send_bytes: int = 32 << 20,
            max_receive_bytes: int = 64 << 20, retry: Optional[Retry] = None, tls: bool = False, ca: str = "",
            cert: str = "", key: str = "", server_name: str = "", token: str = "", token_file: str = "",
            allow_token_without_tls: bool = False, read_from: ReadFrom = ReadFrom.LEADER) -> "Client":
    """Connects to a locusd at `host:port`, `host` (port 7575) or `unix:/path`, or to a cluster.

    For a cluster, give the addresses of some of its servers, separated by commas or as a list; a list may have a single
    one. The client also connects to servers that these name, with the same credentials. `read_from`: the servers of a
    cluster that answer queries. connect() succeeds when one of the addresses answers.

    `timeout`: maximum duration of a call in seconds, including retries, by default 10, for a cluster 30; `retry`:
    policy of retries, by default Retry(), for a cluster one that lasts 20 s, longer than a takeover; `long_timeout`:
    maximum duration, in seconds, of mesh transfers and changes of instances. With `wait_for_server`, connect() retries
    until `timeout` seconds have passed; without it, a refused connection fails immediately with LocusError UNAVAILABLE,
    which names the address.
    `max_send_bytes`, `max_receive_bytes`: maximum message sizes; the server accepts 32 MiB by default, and an answer
    may have up to the batch's `max_reply_bytes`.

    `tls` encrypts the connection; `ca`, `cert` and `server_name` imply it. `ca`: file with the certificates of the
    authorities that may have signed the server's certificate, by default the authorities that gRPC trusts; `cert`,
    `key`: files with the client's certificate chain and its key, for mutual TLS; `server_name`: name in the server's
    certificate if it is not the host of the address. All files are in PEM format and are read once.

    `token`: bearer token that every call carries; `token_file`: file that contains only the token, read again when it
    has changed and when the server refuses the token. Without TLS, a token is sent only to loopback addresses and unix
    sockets, unless `allow_token_without_tls` is set. Raises ValueError for options that contradict each other or that
    would send a token unencrypted to another machine, OSError for a file that cannot be read.
    """
    credentials = Credentials(tls=tls, ca=ca, cert=cert, key=key, server_name=server_name, token=token,
                              token_file=token_file, allow_token_without_tls=allow_token_without_tls)
    several = not isinstance(address, str) or ("," in address and not address.startswith("unix:"))
    total = timeout if timeout is not None else _CLUSTER_TIMEOUT if several else _TIMEOUT
    policy = retry if retry is not None else _CLUSTER_RETRY if several else Retry()

    def connection(target: str) -> Connection:
        return Connection(target, timeout=total, long_timeout=long_timeout, max_send_bytes=max_send_bytes,
                          max_receive_bytes=max_receive_bytes, retry=policy, credentials=credentials, is_member=several)

    if isinstance(address, str) and not several:
        client = Client(connection(address))
    else:
        addresses = [one.strip() for one in (address.split(",") if isinstance(address, str) else address)]
        if not addresses:
            raise ValueError("there is no address: give one or more")
        client = Client(ClusterConnection(addresses, connection, timeout=total, long_timeout=long_timeout, retry=policy,
                                read_from=read_from))
    try:
        client._connection.greet(wait_for_server)
    except BaseException:
        client.close()
        raise
    return client


class Client:
    """Connection returned by connect(). Thread-safe. Use it as a context manager, or call close()."""

    def __init__(self, connection: Union[Connection, ClusterConnection]) -> None:
        self._connection = connection
        self._unary = connection.unary

    @property
    def address(self) -> str:
        """Address of the server, with its port; the given addresses of a cluster, joined by commas."""
        return self._connection.address

    def close(self) -> None:
        """Closes the connection and the streams opened from it."""
        self._connection.close()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, *unused: Any) -> None:
        self.close()

    def server(self) -> Server:
        """Returns the version, features and limits of the server."""
        rpc = _rpc("Server", "GetServer")
        return Server.of(self._unary(rpc, rpc.request(), repeat=True))

    def quotas(self, identity: str = "", *, everybody: bool = False) -> Dict[str, Dict[str, Quota]]:
        """Returns quotas and their use, by identity and by name of the quota. By default these are the quotas of this
        caller and its connection; with `identity`, those of this identity; with `everybody`, those of all identities.
        Only callers that administer all scenes may ask for the quotas of others.
        """
        fields = {"identity": identity, "all": everybody}
        return {entry.identity: {quota.name: Quota.of(quota) for quota in entry.quotas}
                for page in self._pages(_rpc("Server", "GetQuotas"), **fields) for entry in page.identities}

    def healthy(self, service: str = "") -> bool:
        """Returns True if the server, or the service of this full name, reports that it is serving."""
        return bool(self._unary(_HEALTH, _HEALTH.request(service=service), repeat=True).status == _SERVING)

    def create_scene(self, name: str, *, if_absent: bool = False, labels: Optional[Mapping[str, str]] = None,
                     winding: Winding = Winding.UNSPECIFIED, static_from: str = "", history_ticks: int = 0,
                     history_bytes: int = 0, overload: OverloadPolicy = OverloadPolicy.UNSPECIFIED,
                     idle_ttl_s: int = 0, mesh_grace_s: int = 0, cell_size: float = 0,
                     durability: Durability = Durability.UNSPECIFIED, followers: int = 0) -> Scene:
        """Creates an empty scene, or one that starts with the instances of `static_from`.

        `history_ticks`: number of past ticks that can be queried; `history_bytes`: maximum memory of the history, 0 =
        256 MiB. After a restart of the server, the history holds only the ticks after the scene's last snapshot on
        disk.
        `overload`: handling of moves that arrive faster than they can be applied.
        `idle_ttl_s`: the scene is deleted after this number of seconds without a query, an update, a change of
        instances or an open stream; 0 = never. `mesh_grace_s`: a mesh that the scene used is deleted this number of
        seconds after no scene uses it any more; 0 = never.
        `cell_size`: edge of the cells of the objects' grid, rounded up to a power of two; 0 = the server chooses it. It
        affects only the cost of queries and updates.
        `durability`: changes that survive a crash; by default all acknowledged ones in a cluster (REPLICATED) and on a
        server with a data directory (LOCAL). `followers`: number of servers of a cluster, at most 8, that follow the
        scene; they answer queries, and take over without reading the scene anew.
        `if_absent`: returns an existing scene of this name unchanged instead of failing with ALREADY_EXISTS.
        """
        rpc = _rpc("Scene", "CreateScene")
        request = rpc.request(name=name, if_absent=if_absent)
        request.spec.labels.update(labels or {})
        request.spec.winding = winding
        request.spec.static_from = static_from
        request.spec.history_ticks = history_ticks
        request.spec.history_bytes = history_bytes
        request.spec.overload = overload
        request.spec.idle_ttl_s = idle_ttl_s
        request.spec.mesh_grace_s = mesh_grace_s
        request.spec.cell_size = cell_size
        request.spec.durability = durability
        request.spec.followers = followers
        return Scene.of(self._unary(rpc, request, scene=name, route=static_from).scene)

    def scene(self, name: str) -> Scene:
        """Returns the current description of a scene."""
        rpc = _rpc("Scene", "GetScene")
        return Scene.of(self._unary(rpc, rpc.request(name=name), scene=name, repeat=True).scene)

    def scenes(self, labels: Optional[Mapping[str, str]] = None) -> List[Scene]:
        """Returns all scenes that have these labels, ascending by name."""
        pages = self._pages(_rpc("Scene", "ListScenes"), labels=labels or {})
        return [Scene.of(scene) for page in pages for scene in page.scenes]

    def update_scene(self, name: str, *, cell_size: Optional[float] = None,
                     labels: Optional[Mapping[str, str]] = None) -> None:
        """Changes settings of a scene; None leaves a setting as it is. Makes no revision, since no answer changes.

        `cell_size`: that of create_scene(); objects are refiled a few thousand with each update. `labels`: replace all
        labels of the scene.
        """
        rpc = _rpc("Scene", "UpdateScene")
        request = rpc.request(name=name, labels=labels or {}, cell_size=cell_size or 0)
        if cell_size is not None:
            request.fields.append("cell_size")
        if labels is not None:
            request.fields.append("labels")
        self._unary(rpc, request, scene=name)

    def delete_scene(self, name: str, *, if_present: bool = False) -> None:
        """Deletes a scene with its objects and instances; meshes stay."""
        rpc = _rpc("Scene", "DeleteScene")
        self._unary(rpc, rpc.request(name=name, if_present=if_present), scene=name)
        self._connection.forget(name)

    def move_scene(self, scene: str, to: str = "") -> Leadership:
        """Moves the leadership of a scene to another server of the cluster. Updates wait for at most about a second.

        `to`: address of the new leader, as in Server.cluster; by default the less loaded of two other servers. Needs the
        right `admin` to the scene.
        """
        rpc = _rpc("Server", "MoveScene")
        moved = self._unary(rpc, rpc.request(scene=scene, to=to), scene=scene)
        return Leadership(moved.leader, moved.token)

    def upload_mesh(self, name: str, vertices: columns.ColumnLike, indices: columns.ColumnLike,
                    parts: Sequence[MeshPart] = (), progress: Optional[meshes.Progress] = None) -> Mesh:
        """Uploads a mesh of V vertices and T triangles. Returns when the mesh's tree is built.

        `vertices`: 3V float32, x, y, z of each vertex; `indices`: 3T uint32, three vertex indices per triangle.

        A mesh whose content the server already has is not sent again. Safe to repeat.
        """
        rpc = _rpc("Scene", "UploadMesh")

        def attempt(connection: Connection, timeout: float) -> bytes:
            messages = meshes.upload_messages(name, vertices, indices, parts, progress)
            call = connection.channel.stream_unary(rpc.path, rpc.request.SerializeToString)
            _, metadata = connection.metadata()
            return bytes(call(messages, timeout=timeout, metadata=metadata))

        raw = self._connection.transfer(attempt)
        mesh = Mesh.of(parsed(rpc.response, raw).mesh)
        # The reply may lack some of the parts, but the server's parts are those of this upload.
        return dataclasses.replace(mesh, parts=tuple(MeshPart(part.name, part.first_triangle) for part in parts))

    def download_mesh(self, name: str) -> MeshColumns:
        """Returns an uploaded mesh with its columns, as the server stores it."""
        rpc = _rpc("Scene", "DownloadMesh")

        def attempt(connection: Connection, timeout: float) -> List[Any]:
            call = connection.channel.unary_stream(rpc.path)
            _, metadata = connection.metadata()
            answers = call(rpc.request(mesh=name).SerializeToString(), timeout=timeout, metadata=metadata)
            return [parsed(rpc.response, raw) for raw in answers]

        return MeshColumns.of(self._connection.transfer(attempt))

    def meshes(self) -> List[Mesh]:
        """Returns all uploaded meshes, ascending by name."""
        rpc = _rpc("Scene", "ListMeshes")
        all_meshes = []
        for page in self._pages(rpc):
            for mesh in page.meshes:
                # A reply has as many parts as clients accept; further replies have the rest.
                while len(mesh.parts) < mesh.part_count:
                    request = rpc.request(mesh=mesh.name, first_part=len(mesh.parts))
                    more = [other for other in self._unary(rpc, request).meshes if other.parts]
                    if len(more) != 1 or more[0].sha256 != mesh.sha256:
                        raise LocusError(grpc.StatusCode.ABORTED, f"mesh {mesh.name} changed while its parts were read")
                    mesh.parts.extend(more[0].parts)
                all_meshes.append(Mesh.of(mesh))
        return all_meshes

    def delete_mesh(self, name: str) -> None:
        """Deletes a mesh that no instance uses."""
        rpc = _rpc("Scene", "DeleteMesh")
        self._unary(rpc, rpc.request(mesh=name))

    def change_instances(self, scene: str, change: InstanceChange, *, no_wait: bool = False) -> PlacedInstances:
        """Removes and places instances as one revision. Returns when queries see the change or, with `no_wait`, as soon
        as the server has accepted the change.
        """
        rpc = _rpc("Scene", "ChangeInstances")
        request = rpc.request()
        request.CopyFrom(change.message)
        request.scene = scene
        request.no_wait = no_wait
        response = self._unary(rpc, request, scene=scene, timeout=self._connection.long_timeout)
        return PlacedInstances.of(response)

    def apply(self, scene: str, batch: UpdateBatch) -> Ack:
        """Applies one batch. If a retry is refused, the LocusError has no reason, because an earlier attempt may have
        applied the batch. For a sequence of batches use update_stream().
        """
        rpc = _rpc("Update", "ApplyUpdates")
        once_only = batch.message.writer != 0 and batch.message.batch != 0
        raw = self._connection.unary_bytes(rpc.path, batch.request_bytes(scene), scene=scene, repeat=once_only,
                                           is_update=True)
        ack = Ack.of(parsed(rpc.response, raw).ack)
        self._connection.saw(scene, ack)
        return ack

    def query(self, scene: str, batch: QueryBatch) -> QueryResult:
        """Runs one batch of queries, all at one revision. For a sequence of batches use query_stream()."""
        try:
            return QueryResult.from_bytes(self._connection.query_bytes(
                _QUERY.path, batch.request_bytes(scene), scene, batch.names_revision, batch.leader_only))
        except LocusError as error:
            if error.code != grpc.StatusCode.DEADLINE_EXCEEDED or error.refused:
                raise
            raise late_query(scene, batch.waits_for) from error

    def step(self, scene: str, update: UpdateBatch, queries: QueryBatch) -> StepResult:
        """Makes a step: applies `update`, then runs `queries` at a revision that contains it, in one call.

        Raises LocusError if the step was refused; if the server refused it, nothing was changed and no query was run.
        An error of queries whose update was applied is in StepResult.error. For a step every tick use
        QueryStream.step().
        """
        rpc = _rpc("Query", "Step")
        numbers = schema.numbers("StepRequest")
        changes, batch = update.message.SerializeToString(), queries.batch_bytes()
        request = b"".join((rpc.request(scene=scene).SerializeToString(), wire.head(numbers["update"], len(changes)),
                            changes, wire.head(numbers["queries"], len(batch)), batch))
        once_only = update.message.writer != 0 and update.message.batch != 0
        result = StepResult.from_bytes(
            self._connection.unary_bytes(rpc.path, request, scene=scene, repeat=once_only, is_update=True))
        self._connection.saw(scene, result.ack)
        return result

    def query_bytes(self, scene: str, request: bytes) -> bytes:
        """Runs an encoded batch. `request` are the bytes from QueryBatch.request_bytes(). Returns the bytes of the
        response, for QueryResult.from_bytes().

        For callers that reuse requests, or measure the cost of encoding and decoding. In a cluster, the batch is answered
        at the revision that it names, also if that is lower than one seen before; without one, as by query().
        """
        return self._connection.query_bytes(_QUERY.path, request, scene, names_revision(request), False)

    def update_stream(self, scene: str, *, max_in_flight: int = 8, reconnect: Optional[Retry] = None,
                      lease_ms: int = 0) -> UpdateStream:
        """Returns a pipelined stream of update batches to one scene, each applied exactly once. The stream connects
        when the first batch is sent. `reconnect`: policy of attempts to connect again, by default 10 attempts, in a
        cluster the policy for its calls.

        `lease_ms`: lease of the stream's writer in milliseconds, at most one day; 0 = none. When no batch of the stream
        has arrived for that long, the server removes all objects that the stream inserted. See UpdateStream.
        """
        return UpdateStream(self._connection, scene, max_in_flight, self._reconnect(reconnect, _RECONNECT), lease_ms)

    def query_stream(self, scene: str, *, max_in_flight: int = 8, reconnect: Optional[Retry] = None,
                     lease_ms: int = 0) -> QueryStream:
        """Returns a pipelined stream of query batches to one scene. The stream connects when the first batch is sent.

        `lease_ms`: lease of the writer of the stream's steps, as for update_stream(); it begins with the first step.
        """
        return QueryStream(self._connection, scene, max_in_flight, self._reconnect(reconnect, Retry()), lease_ms)

    def _reconnect(self, given: Optional[Retry], alone: Retry) -> Retry:
        if given is not None:
            return given
        return self._connection.retry if isinstance(self._connection, ClusterConnection) else alone

    def _pages(self, rpc: schema.Method, **fields: Any) -> Iterator[Any]:
        request = rpc.request(**fields)
        while True:
            page = self._unary(rpc, request, repeat=True)
            yield page
            if not page.next_page_token:
                return
            request.page_token = page.next_page_token
