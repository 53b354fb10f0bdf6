"""Tests that update streams apply batches in order and exactly once, across refusals and broken connections."""
import socket
import threading
import time
import unittest
from concurrent import futures

import grpc
import locus
from locus import QueryBatch, UpdateBatch, schema
from support import WAIT_SECONDS, Daemon, DaemonTest, listed

UPDATES, STEPS = schema.method("locus.v1.UpdateService", "StreamUpdates"), schema.method("locus.v1.QueryService",
                                                                                         "StreamQueries")


class Relay:
    """TCP proxy in front of a server; cut() breaks every connection through it."""

    def __init__(self, address):
        self.target = address
        self.lock = threading.Lock()
        self.sockets = []
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:%d" % self.listener.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def connect(self):
        if not self.target.startswith("unix:"):
            host, port = self.target.rsplit(":", 1)
            return socket.create_connection((host, int(port)))
        connected = socket.socket(socket.AF_UNIX)
        connected.connect(self.target[len("unix:"):])
        return connected

    def accept(self):
        while True:
            try:
                near, _ = self.listener.accept()
                far = self.connect()
            except OSError:
                return
            with self.lock:
                self.sockets += [near, far]
            for source, sink in ((near, far), (far, near)):
                threading.Thread(target=self.pump, args=(source, sink), daemon=True).start()

    def pump(self, source, sink):
        try:
            while data := source.recv(65536):
                sink.sendall(data)
        except OSError:
            pass

    def cut(self):
        with self.lock:
            for one in self.sockets:
                try:
                    one.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass
                one.close()
            self.sockets.clear()

    def close(self):
        self.listener.shutdown(socket.SHUT_RDWR)  # wakes accept(); close() alone does not
        self.listener.close()
        self.cut()


class FakeServer:
    """Server of updates and steps that loses the first answer to tick 2 and breaks the call then. When tick 2 is sent
    again, it is refused before its number is checked, as the server refuses a step whose view names an old epoch.
    """

    def __init__(self, applies_lost):
        self.applies_lost = applies_lost
        self.applied, self.lost = [], False
        self.pool = futures.ThreadPoolExecutor(8)
        self.server = grpc.server(self.pool)
        stream, unary = grpc.stream_stream_rpc_method_handler, grpc.unary_unary_rpc_method_handler
        handlers = {"UpdateService": {"StreamUpdates": stream(self.updates), "ApplyUpdates": unary(self.update)},
                    "QueryService": {"StreamQueries": stream(self.steps), "Step": unary(self.step)},
                    "ServerService": {"GetServer": unary(lambda request, context: b"")}}
        self.server.add_generic_rpc_handlers([
            grpc.method_handlers_generic_handler("locus.v1." + name, methods) for name, methods in handlers.items()])
        self.address = "127.0.0.1:%d" % self.server.add_insecure_port("127.0.0.1:0")
        self.server.start()

    def stop(self):
        self.server.stop(None).wait()
        self.pool.shutdown()

    def apply(self, batch, response):
        """Fills in the ack or the error of a batch. Returns False if the call must break."""
        if batch.tick == 2:
            if not self.lost:
                self.lost = True
                if self.applies_lost:
                    self.applied.append(batch.tick)
                return False
            response.error.code, response.error.reason = 9, locus.Reason.SCENE_RESTARTED.value
            response.error.message = "planned"
            return True
        if batch.batch > len(self.applied) + 1:
            response.error.code, response.error.reason = 9, locus.Reason.BATCH_GAP.value
            response.error.limit_value = len(self.applied) + 1
            return True
        response.ack.duplicate = batch.batch <= len(self.applied)
        if not response.ack.duplicate:
            self.applied.append(batch.tick)
        response.ack.revision = len(self.applied)
        return True

    def answers(self, method, requests, context, update_of):
        for raw in requests:
            request = method.request.FromString(raw)
            response = method.response(sequence=request.sequence)
            if not self.apply(update_of(request), response):
                context.abort(grpc.StatusCode.UNAVAILABLE, "planned")
            if method is STEPS and response.HasField("ack"):
                response.result.revision = response.ack.revision
            yield response.SerializeToString()

    def updates(self, requests, context):
        return self.answers(UPDATES, requests, context, lambda request: request.batch)

    def steps(self, requests, context):
        return self.answers(STEPS, requests, context, lambda request: request.update)

    def answer(self, batch, context):
        response = UPDATES.response()
        if not self.apply(batch, response):
            context.abort(grpc.StatusCode.UNAVAILABLE, "planned")
        status = schema.message("Status")(code=response.error.code, message=response.error.message)
        status.details.add(type_url="type.googleapis.com/locus.v1.Error", value=response.error.SerializeToString())
        context.set_trailing_metadata((("grpc-status-details-bin", status.SerializeToString()),))
        context.abort(grpc.StatusCode.FAILED_PRECONDITION, response.error.message)

    def update(self, raw, context):
        return self.answer(schema.method("locus.v1.UpdateService", "ApplyUpdates").request.FromString(raw).batch, context)

    def step(self, raw, context):
        return self.answer(schema.method("locus.v1.QueryService", "Step").request.FromString(raw).update, context)


class RepeatedUpdateTest(unittest.TestCase):
    """Tests of updates that are refused when they are sent again after their first answer was lost."""

    def started(self, applies_lost):
        server = FakeServer(applies_lost)
        self.addCleanup(server.stop)
        client = locus.connect(server.address, retry=locus.Retry(attempts=20, first_wait=0.01))
        self.addCleanup(client.close)
        return server, client

    def check(self, error):
        self.assertEqual((error.code, error.refused), (grpc.StatusCode.FAILED_PRECONDITION, False))
        self.assertIn("may have been applied", str(error))

    def test_a_stream_frees_the_number_only_if_the_update_was_not_applied(self):
        for applies_lost in (True, False):
            for steps in (True, False):
                with self.subTest(applies_lost=applies_lost, steps=steps):
                    server, client = self.started(applies_lost)
                    quick = locus.Retry(attempts=20, first_wait=0.01)
                    with (client.query_stream if steps else client.update_stream)("arena", reconnect=quick) as stream:
                        sent = [stream.step(UpdateBatch(tick=tick), QueryBatch().lookup(1)) if steps else
                                stream.send(UpdateBatch(tick=tick)) for tick in range(1, 7)]
                    self.check(sent.pop(1).exception(WAIT_SECONDS))
                    acks = [future.result(WAIT_SECONDS) for future in sent]
                    self.assertFalse(any((ack.ack if steps else ack).duplicate for ack in acks))
                    self.assertEqual(server.applied, [1, 2, 3, 4, 5, 6] if applies_lost else [1, 3, 4, 5, 6])

    def test_a_refused_retry_of_a_call_has_an_unknown_outcome(self):
        for step in (True, False):
            _, client = self.started(True)
            update = UpdateBatch(tick=2, writer=5, number=1)
            with self.assertRaises(locus.LocusError) as failed:
                client.step("arena", update, QueryBatch().lookup(1)) if step else client.apply("arena", update)
            self.check(failed.exception)
            with self.assertRaises(locus.LocusError) as refused:
                client.apply("arena", update)
            self.assertTrue(refused.exception.refused, "refused at the first attempt")


class HoldingServer(FakeServer):
    """Server of updates that holds messages with `continues`, and breaks the first `breaks` calls at their message number
    `after`, which is lost. Refuses the updates whose ticks are in `refused`. `applied` lists the tick and the number of
    messages of each applied update, `leases` their leases.
    """

    def __init__(self, breaks=0, after=0, refused=()):
        self.breaks, self.after, self.refused, self.leases, self.knows_continues = breaks, after, refused, [], True
        super().__init__(False)

    def updates(self, requests, context):
        held, is_refused = 0, False
        for number, raw in enumerate(requests, 1):
            request = UPDATES.request.FromString(raw)
            batch, response = request.batch, UPDATES.response(sequence=request.sequence)
            if self.breaks and number >= self.after:
                self.breaks -= 1
                context.abort(grpc.StatusCode.UNAVAILABLE, "planned")
            if batch.continues and self.knows_continues:
                is_refused = is_refused or batch.HasField("tick") or batch.writer != 0
                held += 1
                if is_refused:
                    self.refuse(response, locus.Reason.MALFORMED)
                else:
                    response.ack.pending = True
            else:
                if is_refused:
                    self.refuse(response, locus.Reason.COLUMN_LENGTH)
                else:
                    self.apply_held(batch, held, response)
                held, is_refused = 0, False
            yield response.SerializeToString()

    def refuse(self, response, reason):
        response.error.code, response.error.reason = 3, reason.value

    def apply_held(self, batch, held, response):
        if batch.batch > len(self.applied) + 1:
            self.refuse(response, locus.Reason.BATCH_GAP)
        elif batch.batch == len(self.applied) + 1 and batch.tick in self.refused:
            self.refuse(response, locus.Reason.OUT_OF_RANGE)
        else:
            response.ack.duplicate = batch.batch <= len(self.applied)
            if not response.ack.duplicate:
                self.applied.append((batch.tick, held + 1))
                self.leases.append(batch.lease_ms)
            response.ack.revision = len(self.applied)


class SeveralMessagesTest(unittest.TestCase):
    """Tests of batches that are sent together, and of leases."""

    def stream(self, server, **options):
        self.addCleanup(server.stop)
        client = locus.connect(server.address)
        self.addCleanup(client.close)
        return client.update_stream("arena", reconnect=locus.Retry(attempts=20, first_wait=0.01), **options)

    def group(self, tick, messages):
        return [UpdateBatch() for _ in range(messages - 1)] + [UpdateBatch(tick=tick)]

    def test_batches_sent_together_are_applied_as_one(self):
        server = HoldingServer()
        with self.stream(server, max_in_flight=2) as stream:
            sent = [stream.send_together(self.group(tick, 1 + tick % 4)) for tick in range(1, 21)]
            with self.assertRaisesRegex(ValueError, "at least one batch"):
                stream.send_together([])
        self.assertEqual([future.result().revision for future in sent], list(range(1, 21)))
        self.assertEqual(server.applied, [(tick, 1 + tick % 4) for tick in range(1, 21)])

    def test_all_are_sent_again_after_a_break(self):
        for after in (7, 8, 9):  # the first, second and third message of an update
            server = HoldingServer(breaks=5, after=after)
            with self.stream(server) as stream:
                sent = [stream.send_together(self.group(tick, 3)) for tick in range(1, 26)]
            self.assertEqual([future.exception() for future in sent], [None] * 25)
            self.assertEqual(server.applied, [(tick, 3) for tick in range(1, 26)])

    def test_renumbered_messages_never_join_those_that_the_server_holds(self):
        refused = (1, 2, 9, 15, 16)
        server = HoldingServer(refused=refused)
        with self.stream(server, max_in_flight=4) as stream:
            sent = [stream.send_together(self.group(tick, 1 + tick % 6)) for tick in range(1, 41)]
        self.assertEqual([tick for tick, future in enumerate(sent, 1) if future.exception()], list(refused))
        self.assertEqual(server.applied, [(tick, 1 + tick % 6) for tick in range(1, 41) if tick not in refused])

    def test_a_refused_message_refuses_its_update_only(self):
        server = HoldingServer()
        with self.stream(server) as stream:
            sent = [stream.send_together([UpdateBatch(tick=5 if tick == 2 else None), UpdateBatch(tick=tick)])
                    for tick in (1, 2, 3)]
        self.assertEqual(sent[1].exception().reason, locus.Reason.MALFORMED)
        self.assertEqual(server.applied, [(1, 2), (3, 2)])

    def test_a_server_that_applies_messages_one_by_one_ends_the_stream(self):
        server = HoldingServer()
        server.knows_continues = False
        stream = self.stream(server)
        error = stream.send_together(self.group(1, 2)).exception(WAIT_SECONDS)
        self.assertEqual(error.code, grpc.StatusCode.UNIMPLEMENTED)
        with self.assertRaises(locus.LocusError):
            stream.close(WAIT_SECONDS)

    def wait_for(self, condition):
        deadline = time.monotonic() + WAIT_SECONDS
        while not condition():
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.001)

    def test_a_silent_stream_renews_its_lease_also_on_a_new_connection(self):
        server = HoldingServer()
        with self.stream(server, lease_ms=30) as stream:
            stream.send(UpdateBatch(tick=1)).result(WAIT_SECONDS)
            self.wait_for(lambda: len(server.applied) >= 4)
            server.after = 1
            server.breaks = 1
            before = len(server.applied)
            self.wait_for(lambda: len(server.applied) >= before + 4)
        self.assertEqual(set(server.leases), {30})
        self.assertEqual(server.applied[1:], [(0, 1)] * (len(server.applied) - 1))
        for wrong in (-1, 2**32):
            with self.assertRaisesRegex(ValueError, "lease_ms is"):
                self.stream(HoldingServer(), lease_ms=wrong)


class UpdateStreamTest(DaemonTest):
    def moved(self, number):
        return UpdateBatch(upsert=True).insert_balls([1, 1 + number], [number, 0, 0], 0.5)

    def x_of(self, number, view=None):
        (block,) = self.ask(QueryBatch(at_least=view).lookup(number))
        return listed(block.positions)[0]

    def test_batches_are_applied_in_the_order_sent(self):
        with self.client.update_stream(self.scene) as stream:
            futures = [stream.send(self.moved(number)) for number in range(1, 101)]
            stream.sync(WAIT_SECONDS)
            self.assertTrue(all(future.done() for future in futures))
            self.assertEqual([future.result().revision for future in futures], list(range(1, 101)))
            self.assertEqual(stream.last_ack.revision, 100)
            self.assertEqual(self.x_of(1, stream.last_ack), 100)

    def test_a_batch_may_be_changed_and_sent_again(self):
        batch = UpdateBatch(upsert=True).insert_balls(1, [0, 0, 0], 1)
        with self.client.update_stream(self.scene) as stream:
            first = stream.send(batch)
            batch.insert_balls(2, [1, 0, 0], 1)
            second = stream.send(batch)
        self.assertEqual((first.result().applied, second.result().applied), (1, 2))

    def test_a_refused_batch_does_not_stop_later_ones(self):
        with self.client.update_stream(self.scene) as stream:
            futures = []
            for number in range(1, 41):
                futures.append(stream.send(self.moved(number)))
                if number % 5 == 0:
                    futures.append(stream.send(UpdateBatch(all_or_nothing=True).remove(10**6 + number)))
        refused = [future.exception() for future in futures if future.exception()]
        acks = [future.result() for future in futures if not future.exception()]
        self.assertEqual([ack.revision for ack in acks], list(range(1, 41)))
        self.assertEqual(len(refused), 8)
        self.assertRefused(refused[0], "INVALID_ARGUMENT", "UNKNOWN_ID", "remove_ids")
        self.assertEqual([error.index for error in refused], [0] * 8)

    def test_no_batch_is_lost_or_applied_twice_when_connections_break(self):
        relay = Relay(self.daemon.address)
        self.addCleanup(relay.close)
        batches = 120
        with locus.connect(relay.address) as client:
            with client.update_stream(self.scene) as stream:
                futures = []
                for number in range(1, batches + 1):
                    futures.append(stream.send(self.moved(number)))
                    if number in (20, 50, 51, 90):
                        relay.cut()
                stream.sync(WAIT_SECONDS)
        # Each batch makes one revision, so the last revision gives the number of applied batches.
        self.assertEqual(futures[-1].result().revision, batches)
        self.assertEqual(self.client.scene(self.scene).revision, batches)
        self.assertEqual(self.client.scene(self.scene).objects, batches + 1)

    def test_no_step_is_lost_or_applied_twice_when_connections_break(self):
        relay = Relay(self.daemon.address)
        self.addCleanup(relay.close)
        steps = 120
        with locus.connect(relay.address) as client:
            with client.query_stream(self.scene) as stream:
                futures = []
                for number in range(1, steps + 1):
                    futures.append(stream.step(self.moved(number), QueryBatch().lookup(1 + number)))
                    if number in (20, 50, 51, 90):
                        relay.cut()
                stream.sync(WAIT_SECONDS)
        self.assertEqual(self.client.scene(self.scene).revision, steps)
        for number, future in enumerate(futures, 1):
            self.assertEqual(listed(future.result().result.blocks[0].ids), [1 + number])

    def test_sending_waits_while_too_many_batches_are_under_way(self):
        relay = Relay(self.daemon.address)
        client = locus.connect(relay.address)
        stream = client.update_stream("no-such-scene", max_in_flight=2)
        relay.close()
        futures = [stream.send(self.moved(number)) for number in (1, 2)]
        third = threading.Thread(target=lambda: futures.append(self.outcome_of(stream)), daemon=True)
        third.start()
        third.join(0.3)
        self.assertEqual(len(futures), 2)
        stream.cancel()
        third.join(WAIT_SECONDS)
        self.assertEqual(futures[2].code, grpc.StatusCode.CANCELLED)
        client.close()

    def outcome_of(self, stream):
        try:
            return stream.send(self.moved(3))
        except locus.LocusError as error:
            return error

    def test_each_batch_to_a_deleted_scene_is_refused_individually(self):
        with self.client.update_stream(self.scene) as stream:
            stream.send(self.moved(1)).result(WAIT_SECONDS)
            self.client.delete_scene(self.scene)
            for _ in range(2):
                error = stream.send(self.moved(2)).exception(WAIT_SECONDS)
                self.assertRefused(error, "NOT_FOUND", "NOT_FOUND")

    def test_a_scene_that_started_over_ends_the_stream(self):
        stream = self.client.update_stream(self.scene)
        for number in (1, 2):
            stream.send(self.moved(number)).result(WAIT_SECONDS)
        self.client.delete_scene(self.scene)
        self.client.create_scene(self.scene)
        self.assertRefused(stream.send(self.moved(3)).exception(WAIT_SECONDS), "FAILED_PRECONDITION", "BATCH_GAP")
        with self.assertRaisesRegex(locus.LocusError, "BATCH_GAP"):
            stream.sync(WAIT_SECONDS)
        with self.assertRaisesRegex(locus.LocusError, "BATCH_GAP"):
            stream.send(self.moved(4))

    def test_a_bad_name_ends_the_stream(self):
        stream = self.client.update_stream("No Scene")
        self.assertRefused(stream.send(self.moved(1)).exception(WAIT_SECONDS), "INVALID_ARGUMENT", "MALFORMED")
        with self.assertRaises(locus.LocusError):
            stream.close(WAIT_SECONDS)

    def test_a_stopped_server_ends_the_stream_after_the_last_attempt(self):
        daemon = Daemon()
        client = locus.connect(daemon.address)
        client.create_scene("arena")
        stream = client.update_stream("arena", reconnect=locus.Retry(attempts=3, first_wait=0.01))
        stream.send(self.moved(1)).result(WAIT_SECONDS)
        daemon.kill()
        error = stream.send(self.moved(2)).exception(WAIT_SECONDS)
        self.assertEqual((error.code, error.refused), (grpc.StatusCode.UNAVAILABLE, False))
        client.close()

    def test_a_closed_stream_accepts_no_batch(self):
        stream = self.client.update_stream(self.scene)
        stream.send(self.moved(1))
        stream.close(WAIT_SECONDS)
        with self.assertRaisesRegex(locus.LocusError, "the stream was closed: open a new one"):
            stream.send(self.moved(2))

    def test_closing_the_client_ends_its_streams(self):
        client = locus.connect(self.daemon.address)
        stream = client.update_stream(self.scene)
        stream.send(self.moved(1)).result(WAIT_SECONDS)
        client.close()
        error = stream.send(self.moved(2)).exception(WAIT_SECONDS)
        self.assertIn("the client was closed", str(error))

    def test_an_exception_in_the_context_cancels_the_stream(self):
        with self.assertRaises(ZeroDivisionError):
            with self.client.update_stream(self.scene) as stream:
                raise ZeroDivisionError
        with self.assertRaisesRegex(locus.LocusError, "broken off|closed"):
            stream.send(self.moved(1))

    def test_a_max_in_flight_of_zero_is_refused(self):
        with self.assertRaisesRegex(ValueError, "max_in_flight is 0: give 1 or more"):
            self.client.update_stream(self.scene, max_in_flight=0)


class WaitingTest(DaemonTest):
    def wait_for(self, condition):
        deadline = time.monotonic() + WAIT_SECONDS
        while not condition():
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)

    def found(self, *ids):
        return listed(self.ask(QueryBatch().lookup(list(ids)))[0].ids)

    def refused(self, batch, code, reason, field):
        with self.assertRaises(locus.LocusError) as raised:
            self.apply(batch)
        self.assertRefused(raised.exception, code, reason, field)

    def item_errors(self, batch):
        return [(error.field, error.index, error.reason.name) for error in self.apply(batch).errors]


class LifetimesTest(WaitingTest):
    def test_objects_expire_with_the_first_batch_of_their_last_tick(self):
        self.apply(UpdateBatch(tick=10).insert_points([1, 2, 3], [0, 0, 0], expire_ticks=[5, 6, 0]))
        self.apply(UpdateBatch(tick=14))
        self.assertEqual(self.found(1, 2, 3), [1, 2, 3])
        self.apply(UpdateBatch(tick=15).insert_points(1, [0, 0, 0]))
        self.assertEqual(self.found(1, 2, 3), [1, 2, 3], "1 has expired before it was inserted again")
        self.apply(UpdateBatch(tick=100))
        self.assertEqual(self.found(1, 2, 3), [1, 0, 3])

    def test_too_long_a_lifetime_is_refused(self):
        batch = UpdateBatch().insert_points([1, 2], [0, 0, 0], expire_ticks=[2**48, 2**48 + 1])
        self.assertEqual(self.item_errors(batch), [("inserts[0].expire_ticks", 1, "OUT_OF_RANGE")])

    def test_objects_of_a_silent_writer_go_in_one_revision(self):
        self.apply(UpdateBatch().insert_points(9, [0, 0, 0]))
        before = self.apply(UpdateBatch(writer=5, number=1, lease_ms=1).insert_points([1, 2], [0, 0, 0])).revision
        self.wait_for(lambda: self.found(1, 2, 9) == [0, 0, 9])
        self.assertEqual(self.client.scene(self.scene).revision, before + 1)

    def test_an_open_stream_keeps_its_objects_and_a_closed_one_does_not(self):
        with self.client.update_stream(self.scene, lease_ms=1500) as stream:
            stream.send(UpdateBatch().insert_points(1, [0, 0, 0])).result(WAIT_SECONDS)
            end = time.monotonic() + 4  # longer than the lease
            while time.monotonic() < end:
                self.assertEqual(self.found(1), [1])
                time.sleep(0.05)
        self.wait_for(lambda: self.found(1) == [0])

    def test_wrong_leases_are_refused(self):
        self.refused(UpdateBatch(lease_ms=1000), "INVALID_ARGUMENT", "MALFORMED", "lease_ms")
        self.refused(UpdateBatch(writer=6, number=1, lease_ms=86_400_001), "INVALID_ARGUMENT", "LIMIT", "lease_ms")


class SeveralMessagesInScenesTest(WaitingTest):
    def test_batches_sent_together_are_one_revision(self):
        with self.client.update_stream(self.scene) as stream:
            first = stream.send_together([UpdateBatch().insert_points([1, 2], [0, 0, 0]),
                                          UpdateBatch().insert_points([2, 3], [0, 0, 0]),
                                          UpdateBatch(tick=7).move(1, [1, 0, 0])])
            second = stream.send(UpdateBatch().remove(1))
        ack = first.result()
        self.assertEqual((ack.revision, ack.tick, ack.applied, ack.refused), (1, 7, 4, 1))
        self.assertEqual([(error.message, error.field, error.index) for error in ack.errors], [(1, "inserts[0].ids", 0)])
        self.assertEqual(second.result().revision, 2)

    def test_a_refused_message_refuses_all(self):
        wrong = {"tick": UpdateBatch(tick=4), "all_or_nothing": UpdateBatch(all_or_nothing=True),
                 "lease_ms": UpdateBatch(lease_ms=5), "positions": UpdateBatch().insert_balls(5, radii=1)}
        with self.client.update_stream(self.scene) as stream:
            for field, batch in wrong.items():
                error = stream.send_together([UpdateBatch().insert_points(1, [0, 0, 0]), batch,
                                              UpdateBatch().insert_points(2, [0, 0, 0])]).exception(WAIT_SECONDS)
                self.assertEqual(error.code.name, "INVALID_ARGUMENT", error)
                self.assertIn(field, error.field)
                self.assertEqual(self.found(1, 2, 5), [0, 0, 0])
            self.assertEqual(stream.send(UpdateBatch().insert_points(1, [0, 0, 0])).result(WAIT_SECONDS).revision, 1)

    def test_a_single_call_has_no_rest(self):
        batch = UpdateBatch()
        batch.message.continues = True
        self.refused(batch, "INVALID_ARGUMENT", "MALFORMED", "continues")


class ScenesTest(WaitingTest):
    def test_an_unused_scene_goes_with_its_meshes(self):
        name = "idle-scene"
        self.client.upload_mesh("idle-mesh", [0, 0, 0, 1, 0, 0, 0, 1, 0], [0, 1, 2])
        made = self.client.create_scene(name, idle_ttl_s=1, mesh_grace_s=1)
        self.assertEqual((made.idle_ttl_s, made.mesh_grace_s), (1, 1))
        self.client.change_instances(name, locus.InstanceChange().place("idle-mesh", [0.0, 0.0, 0.0], ids=1))
        self.wait_for(lambda: name not in [scene.name for scene in self.client.scenes()])
        self.wait_for(lambda: "idle-mesh" not in [mesh.name for mesh in self.client.meshes()])
