"""Support of the tests of clients of a cluster: three locusd on one PostgreSQL, and servers that play members."""
import os
import subprocess
import sys
import tempfile
import time
from concurrent import futures

import grpc
import locus
from locus import schema
from support import BIN, START_SECONDS, WAIT_SECONDS

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../cluster"))
import engine  # noqa: E402

UPDATES = schema.method("locus.v1.UpdateService", "StreamUpdates")
APPLY = schema.method("locus.v1.UpdateService", "ApplyUpdates")
QUERIES = schema.method("locus.v1.QueryService", "StreamQueries")
QUERY = schema.method("locus.v1.QueryService", "Query")
GET_SCENE = schema.method("locus.v1.SceneService", "GetScene")
CREATE_SCENE = schema.method("locus.v1.SceneService", "CreateScene")


class Member:
    """Process of a locusd that belongs to a cluster."""

    def __init__(self, postgres, name):
        self.folder = tempfile.TemporaryDirectory()
        self.holder = engine.hold_port()
        self.address = f"127.0.0.1:{self.holder.getsockname()[1]}"
        self.log = open(os.path.join(self.folder.name, "log"), "wb")
        self.process = subprocess.Popen(
            [os.path.join(BIN, "locusd"), "--listen", self.address, "--http-listen", "", "--zone", name,
             "--cluster", postgres.postgresql_url(name), "--drain-grace-s", "1", "--end-with-parent", str(os.getpid())],
            stdout=self.log, stderr=self.log, env={key: value for key, value in os.environ.items()
                                                   if not key.startswith("LOCUS_")})

    def kill(self):
        self.process.kill()
        self.process.wait(timeout=WAIT_SECONDS)

    def terminate(self):
        """Ends the process in order: it hands its scenes over."""
        self.process.terminate()
        return self.process.wait(timeout=WAIT_SECONDS)

    def close(self):
        if self.process.poll() is None:
            self.kill()
        self.log.close()
        self.folder.cleanup()
        self.holder.close()


def wait_until(condition, seconds=START_SECONDS):
    """Waits until condition() is true and returns its value. An error of a server counts as false."""
    until = time.monotonic() + seconds
    while True:
        value, error = None, None
        try:
            value = condition()
        except locus.LocusError as failure:
            error = failure
        if value:
            return value
        if time.monotonic() > until:
            raise AssertionError(f"the condition did not become true in time: {value!r} {error}")
        time.sleep(0.05)


class FakeMember:
    """Server in this process that answers as the member of a cluster would. `cluster` is shared by all members: a dict
    with `leader`, the address of the leader of every scene, `token`, `applied`, the ticks of the applied updates,
    `numbers`, the highest number of each writer, and `epoch`. It may have `followers`, their addresses; `down`, the codes
    and reasons with which members refuse everything, by address; and `breaks`, which says of an applied batch whether the
    call breaks instead of its ack.
    """

    def __init__(self, cluster):
        self.cluster = cluster
        self.seen = []  # requests of queries
        self.revision = None  # revision of a follower that lags behind; None = the newest
        self.pool = futures.ThreadPoolExecutor(8)
        self.server = grpc.server(self.pool)
        stream, unary = grpc.stream_stream_rpc_method_handler, grpc.unary_unary_rpc_method_handler
        handlers = {"UpdateService": {"StreamUpdates": stream(self.updates), "ApplyUpdates": unary(self.apply)},
                    "QueryService": {"StreamQueries": stream(self.queries), "Query": unary(self.query)},
                    "SceneService": {"GetScene": unary(self.get_scene), "CreateScene": unary(self.create_scene)},
                    "ServerService": {"GetServer": unary(lambda request, context: b"")}}
        self.server.add_generic_rpc_handlers([
            grpc.method_handlers_generic_handler("locus.v1." + name, methods) for name, methods in handlers.items()])
        self.address = "127.0.0.1:%d" % self.server.add_insecure_port("127.0.0.1:0")
        self.server.start()

    def stop(self):
        self.server.stop(None).wait()
        self.pool.shutdown()

    def refusal(self, reads=None):
        """Returns the Error with which a request is refused; None if it is answered. `reads`: the view of a query."""
        error = schema.message("Error")()
        down = self.cluster.get("down", {}).get(self.address)
        if down is not None:
            error.code, error.reason, error.message = down[0], down[1], "planned"
            error.retry_after_ms = 20
        elif self.cluster["leader"] == self.address or (
                reads is not None and not reads.leader_only and self.address in self.cluster.get("followers", ())):
            return None
        elif not self.cluster["leader"]:
            error.code, error.reason, error.message = 14, locus.Reason.NO_LEADER, "no server leads the scene"
            error.retry_after_ms = 20
        else:
            error.code, error.reason, error.message = 9, locus.Reason.ELSEWHERE, "another server has the scene"
            error.addresses.append(self.cluster["leader"])
            error.token = self.cluster["token"]
        return error

    def apply_batch(self, batch, response):
        """Fills in the ack or the error of an update."""
        error = self.refusal()
        expected = self.cluster["numbers"].get(batch.writer, 0) + 1
        if error is None and batch.batch > expected:
            error = schema.message("Error")(code=9, reason=locus.Reason.BATCH_GAP, limit_value=expected)
        if error is not None:
            response.error.CopyFrom(error)
            return
        response.ack.duplicate = bool(batch.batch) and batch.batch < expected
        if not response.ack.duplicate:
            self.cluster["applied"].append(batch.tick)
            if batch.batch:
                self.cluster["numbers"][batch.writer] = batch.batch
        response.ack.epoch, response.ack.revision = self.cluster["epoch"], len(self.cluster["applied"])

    def updates(self, requests, context):
        for raw in requests:
            request = UPDATES.request.FromString(raw)
            response = UPDATES.response(sequence=request.sequence)
            self.apply_batch(request.batch, response)
            if not response.HasField("error") and self.cluster.get("breaks", lambda batch: False)(request.batch):
                context.abort(grpc.StatusCode.UNAVAILABLE, "planned")
            yield response.SerializeToString()

    def apply(self, raw, context):
        response = UPDATES.response()
        self.apply_batch(APPLY.request.FromString(raw).batch, response)
        if response.HasField("error"):
            self.abort(context, response.error)
        if self.cluster.get("breaks", lambda batch: False)(APPLY.request.FromString(raw).batch):
            context.abort(grpc.StatusCode.UNAVAILABLE, "planned")
        return APPLY.response(ack=response.ack).SerializeToString()

    def answer(self, view, response):
        """Fills in the result or the error of a query."""
        self.seen.append(view)
        error = self.refusal(view)
        newest = len(self.cluster["applied"])
        revision = newest if self.revision is None else self.revision
        if error is None and view.epoch and view.epoch != self.cluster["epoch"]:
            error = schema.message("Error")(code=9, reason=locus.Reason.SCENE_RESTARTED, message="another epoch")
        if error is None and view.at_least > revision:
            error = schema.message("Error")(code=4, message="the revision was not reached")
        if error is not None:
            return error
        response.result.epoch, response.result.revision = self.cluster["epoch"], view.exactly or revision
        return None

    def queries(self, requests, context):
        for raw in requests:
            request = QUERIES.request.FromString(raw)
            response = QUERIES.response(sequence=request.sequence)
            error = self.answer(request.batch.view, response)
            if error is not None:
                response.error.CopyFrom(error)
            yield response.SerializeToString()

    def query(self, raw, context):
        response = QUERY.response()
        error = self.answer(QUERY.request.FromString(raw).batch.view, response)
        if error is not None:
            self.abort(context, error)
        return response.SerializeToString()

    def get_scene(self, raw, context):
        error = self.refusal()
        if error is not None:
            self.abort(context, error)
        response = GET_SCENE.response()
        response.scene.placement.leader, response.scene.placement.token = self.cluster["leader"], self.cluster["token"]
        for address in self.cluster.get("followers", ()):
            response.scene.placement.followers.add(address=address)
        return response.SerializeToString()

    def create_scene(self, raw, context):
        error = self.refusal()
        if error is not None:
            self.abort(context, error)
        return CREATE_SCENE.response().SerializeToString()

    @staticmethod
    def abort(context, error):
        if error.reason:
            status = schema.message("Status")(code=error.code, message=error.message)
            status.details.add(type_url="type.googleapis.com/locus.v1.Error", value=error.SerializeToString())
            context.set_trailing_metadata((("grpc-status-details-bin", status.SerializeToString()),))
        context.abort(next(code for code in grpc.StatusCode if code.value[0] == error.code), error.message)
