#!/usr/bin/python3
"""A fake locusd with faults that a call to /fault/NAME switches on, so that attack_test.py can check their detection.

Every other call is answered with an empty message.
"""
import os
import sys
import threading
from concurrent import futures

import grpc

HELD, REFUSING = [], threading.Event()


def die(context):
    os._exit(3)


def grow(context):
    while True:
        HELD.append(bytearray(os.urandom(1 << 20)))


def hold(context):
    HELD.extend(bytearray(os.urandom(1 << 20)) for _ in range(150))
    return b""


def refuse(context):
    REFUSING.set()
    return b""


def descriptors(context):
    HELD.extend(os.pipe() for _ in range(50))
    return b""


def internal(context):
    context.abort(grpc.StatusCode.INTERNAL, "a fault")


def no_text(context):
    context.abort(grpc.StatusCode.INVALID_ARGUMENT, "")


def none(context):
    return b""


FAULTS = {"/fault/" + fault.__name__: fault for fault in (die, grow, hold, refuse, descriptors, internal, no_text, none)}


class Calls(grpc.GenericRpcHandler):
    """Answers every call."""

    def service(self, details):
        return grpc.unary_unary_rpc_method_handler(lambda request, context: self.answer(details.method, context))

    @staticmethod
    def answer(method, context):
        if REFUSING.is_set():
            context.abort(grpc.StatusCode.UNAVAILABLE, "a fault")
        return FAULTS.get(method, none)(context)


def content(path):
    with open(path, "rb") as file:
        return file.read()


def credentials(options):
    pair = [(content(options["--tls-key"]), content(options["--tls-cert"]))]
    authority = content(options["--tls-client-ca"]) if "--tls-client-ca" in options else None
    return grpc.ssl_server_credentials(pair, authority, authority is not None)


def main():
    options = dict(zip(sys.argv[1::2], sys.argv[2::2]))
    server = grpc.server(futures.ThreadPoolExecutor(4), handlers=[Calls()])
    if "--tls-cert" in options:
        port = server.add_secure_port(options["--listen"], credentials(options))
    else:
        port = server.add_insecure_port(options["--listen"])
    server.start()
    if "--port-file" not in options:  # a unix socket has no port
        server.wait_for_termination()
    with open(options["--port-file"] + ".new", "w", encoding="utf-8") as file:
        file.write(str(port))
    os.rename(options["--port-file"] + ".new", options["--port-file"])
    server.wait_for_termination()


if __name__ == "__main__":
    main()
