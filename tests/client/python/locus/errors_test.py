"""Tests of LocusError: errors of the server, errors of gRPC, and responses that cannot be decoded."""
import copy
import pickle
import unittest

import grpc
from locus import LocusError, Reason, Retry, errors, schema


class Call:
    """Failed call, with the members that from_call() uses."""

    def __init__(self, code, details="", metadata=()):
        self.code = lambda: code
        self.details = lambda: details
        self.trailing_metadata = lambda: metadata


def details_of(error):
    status = schema.message("Status")(code=error.code, message=error.message)
    status.details.add(type_url="type.googleapis.com/other.Thing", value=b"x")
    status.details.add(type_url="type.googleapis.com/locus.v1.Error", value=error.SerializeToString())
    return (("other", "1"), ("grpc-status-details-bin", status.SerializeToString()))


def sample(**fields):
    defaults = {"code": 8, "message": "too many", "reason": Reason.LIMIT, "field": "batch", "limit": "items",
                "limit_value": 10, "asked": 11, "retry_after_ms": 250, "index": 0}
    return schema.message("Error")(**{**defaults, **fields})


class ErrorsTest(unittest.TestCase):
    def test_a_refusal_carries_all_details_of_the_server(self):
        error = errors.from_call(Call(grpc.StatusCode.RESOURCE_EXHAUSTED, "too many", details_of(sample())))
        self.assertEqual((error.code, error.reason), (grpc.StatusCode.RESOURCE_EXHAUSTED, Reason.LIMIT))
        self.assertEqual((error.field, error.index), ("batch", 0))
        self.assertEqual((error.limit, error.limit_value, error.asked, error.retry_after), ("items", 10, 11, 0.25))
        self.assertTrue(error.refused and error.worth_repeating)
        self.assertEqual(str(error), "too many [RESOURCE_EXHAUSTED, LIMIT]")

    def test_an_error_that_is_not_from_the_server_has_a_hint(self):
        error = errors.from_call(Call(grpc.StatusCode.UNAVAILABLE, "broken pipe"))
        self.assertEqual(str(error), "broken pipe [UNAVAILABLE] (try again when the server answers)")
        late = errors.from_call(Call(grpc.StatusCode.DEADLINE_EXCEEDED, "Deadline Exceeded"))
        self.assertIn("give it more time (timeout)", str(late))
        self.assertIsNone(error.index)
        self.assertFalse(error.refused)

    def test_details_that_cannot_be_read_are_left_out(self):
        error = errors.from_call(Call(grpc.StatusCode.NOT_FOUND, "gone", (("grpc-status-details-bin", b"\xff\xff"),)))
        self.assertEqual((error.code, error.message, error.reason), (grpc.StatusCode.NOT_FOUND, "gone", Reason.UNSPECIFIED))

    def test_a_refusal_never_has_the_code_ok(self):
        for code in (0, 99, -1):
            self.assertEqual(errors.from_error(sample(code=code)).code, grpc.StatusCode.UNKNOWN)

    def test_a_reason_of_a_newer_server_is_unspecified(self):
        self.assertEqual(errors.reason_of(999), Reason.UNSPECIFIED)

    def test_a_response_that_cannot_be_decoded_is_data_loss(self):
        with self.assertRaisesRegex(LocusError, "cannot be read.*DATA_LOSS"):
            errors.parsed(schema.message("QueryResponse"), b"\xff")

    def test_errors_survive_copying_and_pickling(self):
        error = errors.from_error(sample())
        for twin in (copy.copy(error), pickle.loads(pickle.dumps(error))):
            self.assertEqual((type(twin), vars(twin), str(twin)), (LocusError, vars(error), str(error)))

    def test_every_hint_is_for_a_failure_without_a_reason(self):
        refused = LocusError(grpc.StatusCode.UNAVAILABLE, "draining", reason=Reason.DRAINING)
        self.assertEqual((refused.hint, refused.worth_repeating), ("", True))


class RetryTest(unittest.TestCase):
    def test_waits_double_up_to_the_maximum_until_attempts_run_out(self):
        retry = Retry(attempts=5, first_wait=1, max_wait=3)
        error = LocusError(grpc.StatusCode.UNAVAILABLE, "")
        for failures, wanted in ((1, 1), (2, 2), (3, 3), (4, 3)):
            self.assertTrue(0.8 * wanted <= retry.wait_after(failures, error) <= 1.2 * wanted)
        self.assertIsNone(retry.wait_after(5, error))

    def test_the_servers_retry_hint_is_the_minimum_wait(self):
        error = LocusError(grpc.StatusCode.RESOURCE_EXHAUSTED, "", retry_after=9)
        self.assertEqual(Retry().wait_after(1, error), 9)
