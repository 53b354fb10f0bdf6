"""Hand-written HTTP/2 and gRPC for misbehaving clients: frames may break any rule, and a message need not fit in
memory.

The library h2 opens the connection and hpack decodes replies; this module encodes all other bytes. Only one thread may
use a Connection.
"""
import collections
import select
import socket
import ssl
import struct
import time

import h2.config
import h2.connection
import hpack

DATA, HEADERS, PRIORITY, RST_STREAM, SETTINGS, PUSH_PROMISE, PING, GOAWAY, WINDOW_UPDATE, CONTINUATION = range(10)
END_STREAM, END_HEADERS, ACK, PADDED = 0x1, 0x4, 0x1, 0x8
HEADER_TABLE_SIZE, MAX_CONCURRENT_STREAMS, INITIAL_WINDOW_SIZE, MAX_FRAME_SIZE = 1, 3, 4, 5
FRAME_HEAD = 9
LARGEST_WINDOW = 2**31 - 1
DEFAULT_WINDOW = 65535
PIECE = 16384
IP_BIND_ADDRESS_NO_PORT = 24  # constant of Linux that the module socket lacks
CODES = ("OK", "CANCELLED", "UNKNOWN", "INVALID_ARGUMENT", "DEADLINE_EXCEEDED", "NOT_FOUND", "ALREADY_EXISTS",
         "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION", "ABORTED", "OUT_OF_RANGE", "UNIMPLEMENTED",
         "INTERNAL", "UNAVAILABLE", "DATA_LOSS", "UNAUTHENTICATED")

# Address of a daemon, and how to connect: `context` is an ssl.SSLContext, or None without encryption; `source` is the
# client's own address, or empty if the kernel chooses one.
Target = collections.namedtuple("Target", "host port context source", defaults=(None, ""))
# Result of a call. `code` is the name of a gRPC status, or RESET, CLOSED (connection ended) or TIMEOUT.
Reply = collections.namedtuple("Reply", "code text body")


def frame(kind, flags, stream, payload=b""):
    """Returns an encoded frame. Does not check the arguments."""
    return struct.pack(">I", len(payload))[1:] + struct.pack(">BBI", kind, flags, stream) + payload


def data_head(length, flags, stream):
    """Returns the header of a DATA frame, whose payload is sent separately."""
    return struct.pack(">I", length)[1:] + struct.pack(">BBI", DATA, flags, stream)


def setting(key, value):
    return struct.pack(">HI", key, value)


def hpack_int(value, prefix_bits, first=0):
    """Returns the HPACK encoding of the integer `value` with a prefix of `prefix_bits` bits. `first` contains the bits
    of the first byte before the prefix.
    """
    limit = (1 << prefix_bits) - 1
    if value < limit:
        return bytes([first | value])
    out = bytearray([first | limit])
    value -= limit
    while value >= 128:
        out.append(0x80 | value & 0x7f)
        value >>= 7
    out.append(value)
    return bytes(out)


def hpack_string(text):
    raw = text.encode() if isinstance(text, str) else text
    return hpack_int(len(raw), 7) + raw


def literal(name, value, first=0x00):
    """Returns an HPACK header field whose name is literal. With `first` = 0x40 the receiver adds the field to the
    dynamic table.
    """
    return bytes([first]) + hpack_string(name) + hpack_string(value)


def grpc_fields(path, extra=()):
    """Returns the header fields of a call."""
    return [(":method", "POST"), (":scheme", "http"), (":path", path), (":authority", "locus"),
            ("content-type", "application/grpc"), ("te", "trailers"), *extra]


def header_block(fields, first=0x00):
    return b"".join(literal(name, value, first) for name, value in fields)


def indexed_block(count):
    """Returns a header block that repeats the `count` fields that were added last to the dynamic table, oldest first.
    Precondition: the table was empty before these fields were added.
    """
    return b"".join(hpack_int(61 + count - i, 7, 0x80) for i in range(count))


def message(body, compressed=False):
    """Returns a gRPC message: flag, length, body."""
    return struct.pack(">BI", compressed, len(body)) + body


def messages(body):
    """Returns the complete messages among the bytes of a reply."""
    found, at = [], 0
    while len(body) - at >= 5:
        end = at + 5 + int.from_bytes(body[at + 1:at + 5], "big")
        if end > len(body):
            break
        found.append(bytes(body[at + 5:end]))
        at = end
    return found


def on_streams(template, offsets, first, count):
    """Returns `count` copies of `template`. In copy i, the stream id first + 2 i is written at each of `offsets`."""
    block, size = bytearray(template * count), len(template)
    ids = b"".join(struct.pack(">I", first + 2 * i) for i in range(count))
    for offset in offsets:
        for byte in range(4):
            block[offset + byte::size] = ids[byte::4]
    return block


class Closed(Exception):
    """The other side ended the connection."""


class Connection:
    """One HTTP/2 connection. `window` is the receive window of each stream in bytes. With `grant` the windows are
    renewed as replies arrive.
    """

    def __init__(self, target, window=DEFAULT_WINDOW, grant=True, timeout=10.0, handshake=True, receive_buffer=None):
        self.sock = open_socket(target, timeout, receive_buffer)
        self.timeout, self.grant = timeout, grant
        self.inbox, self.closed, self.next_id = bytearray(), False, 1
        self.decoder = hpack.Decoder(max_header_list_size=1 << 20)
        self.send_window, self.stream_windows = DEFAULT_WINDOW, {}
        self.initial_window, self.max_frame = DEFAULT_WINDOW, PIECE
        self.headers, self.bodies, self.ended = {}, {}, set()
        self.block = None  # (stream, flags, bytes) of a header block that is not complete
        self.answers = bytearray()  # replies to received frames; not sent while another frame is partly written
        self.resets, self.goaway = collections.Counter(), None
        self.sock.setblocking(False)
        if handshake:
            try:
                self.hello(window)
            except BaseException:
                self.close()
                raise

    def hello(self, window):
        plain = h2.connection.H2Connection(config=h2.config.H2Configuration(client_side=True))
        plain.initiate_connection()
        self.send(plain.data_to_send() + frame(SETTINGS, 0, 0, setting(INITIAL_WINDOW_SIZE, window)))
        if self.grant:
            self.send(frame(WINDOW_UPDATE, 0, 0, struct.pack(">I", LARGEST_WINDOW - DEFAULT_WINDOW)))

    def close(self):
        self.sock.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    # Bytes.

    def wait(self, writing, timeout):
        """Waits until bytes can be read or, with `writing`, written. Returns (readable, writable)."""
        if isinstance(self.sock, ssl.SSLSocket) and self.sock.pending():
            return True, writing
        poller = select.poll()  # select() refuses descriptors above 1023
        poller.register(self.sock, select.POLLIN | (select.POLLOUT if writing else 0))
        found = poller.poll(max(timeout, 0) * 1000)
        events = found[0][1] if found else 0
        return bool(events & ~select.POLLOUT), bool(events & select.POLLOUT)

    def receive(self):
        """Reads available bytes. Returns their number; raises Closed at the end of the connection."""
        try:
            got = self.sock.recv(1 << 18)
        except (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError):
            return 0
        except OSError as error:
            self.closed = True
            raise Closed(str(error)) from error
        if not got:
            self.closed = True
            raise Closed("end of the connection")
        self.inbox += got
        return len(got)

    def try_send(self, view):
        """Sends as many of the bytes as the socket accepts. Returns their number."""
        try:
            return self.sock.send(view)
        except (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError):
            return 0
        except OSError as error:
            self.closed = True
            raise Closed(str(error)) from error

    def send(self, data, reading=True):
        """Sends all bytes, and meanwhile reads replies. Raises Closed, or TimeoutError if nothing can be sent."""
        view, end = memoryview(self.answers + data), time.monotonic() + self.timeout
        self.answers = bytearray()
        while len(view):
            readable, writable = self.wait(True, end - time.monotonic())
            if readable and reading:
                self.receive()
                self.handle()
            sent = self.try_send(view) if writable else 0
            if sent:
                view, end = view[sent:], time.monotonic() + self.timeout
            elif time.monotonic() > end:
                raise TimeoutError("the daemon reads nothing")
        self.answer()

    def answer(self):
        """Sends the pending replies to received frames, as long as the daemon reads them."""
        while self.answers and self.wait(True, 0)[1]:
            sent = self.try_send(self.answers)
            if not sent:
                break
            del self.answers[:sent]

    def flood(self, make, until, limit, reading=True):
        """Sends blocks, each returned by make(), until the time is over or `limit` bytes are sent. Discards replies.

        Returns the number of bytes sent. Ends early if the daemon closes the connection, or reads nothing for long.
        """
        total, view, moved = 0, memoryview(b""), time.monotonic()
        while time.monotonic() < until and total < limit:
            if not len(view):
                view = memoryview(make())
            try:
                readable, writable = self.wait(True, 0.2)
                if readable and reading:
                    self.receive()
                    self.inbox.clear()
                sent = self.try_send(view) if writable else 0
            except Closed:
                return total
            view, total = view[sent:], total + sent
            moved = time.monotonic() if sent else moved
            if time.monotonic() - moved > self.timeout:
                return total
        return total

    # Frames.

    def handle(self):
        """Handles the complete frames among the received bytes."""
        at = 0
        while len(self.inbox) - at >= FRAME_HEAD:
            length = int.from_bytes(self.inbox[at:at + 3], "big")
            if len(self.inbox) - at < FRAME_HEAD + length:
                break
            kind, flags, stream = struct.unpack_from(">BBI", self.inbox, at + 3)
            payload = bytes(self.inbox[at + FRAME_HEAD:at + FRAME_HEAD + length])
            at += FRAME_HEAD + length
            self.on_frame(kind, flags, stream & LARGEST_WINDOW, payload)
        del self.inbox[:at]

    def on_frame(self, kind, flags, stream, payload):
        if kind == DATA:
            self.on_data(flags, stream, payload)
        elif kind in (HEADERS, CONTINUATION):
            self.on_headers(kind, flags, stream, payload)
        elif kind == SETTINGS and not flags & ACK:
            self.on_settings(payload)
        elif kind == PING and not flags & ACK:
            self.answers += frame(PING, ACK, 0, payload)
        elif kind == WINDOW_UPDATE:
            more = int.from_bytes(payload, "big")
            if stream == 0:
                self.send_window += more
            elif stream in self.stream_windows:
                self.stream_windows[stream] += more
        elif kind == RST_STREAM:
            self.resets[int.from_bytes(payload, "big")] += 1
            self.ended.add(stream)
        elif kind == GOAWAY:
            self.goaway = payload[8:].decode(errors="replace") or f"code {int.from_bytes(payload[4:8], 'big')}"

    def on_data(self, flags, stream, payload):
        self.bodies.setdefault(stream, bytearray()).extend(payload)
        if self.grant and payload:
            more = struct.pack(">I", len(payload))
            self.answers += frame(WINDOW_UPDATE, 0, 0, more) + frame(WINDOW_UPDATE, 0, stream, more)
        if flags & END_STREAM:
            self.ended.add(stream)

    def on_headers(self, kind, flags, stream, payload):
        if kind == HEADERS:
            self.block = (stream, flags, payload)
        elif self.block:
            self.block = (self.block[0], self.block[1], self.block[2] + payload)
        if flags & END_HEADERS and self.block:
            fields = self.decoder.decode(self.block[2])
            self.headers.setdefault(stream, {}).update(fields)
            if self.block[1] & END_STREAM:
                self.ended.add(stream)

    def on_settings(self, payload):
        for key, value in struct.iter_unpack(">HI", payload):
            if key == INITIAL_WINDOW_SIZE:
                for stream in self.stream_windows:
                    self.stream_windows[stream] += value - self.initial_window
                self.initial_window = value
            elif key == MAX_FRAME_SIZE:
                self.max_frame = value
        self.answers += frame(SETTINGS, ACK, 0)

    # Calls.

    def start(self, path, extra=(), end=False):
        """Opens a stream for a call. Returns the id of the stream."""
        stream, self.next_id = self.next_id, self.next_id + 2
        self.stream_windows[stream] = self.initial_window
        self.send(frame(HEADERS, END_HEADERS | (END_STREAM if end else 0), stream, header_block(grpc_fields(path, extra))))
        return stream

    def write(self, stream, body, end=True, until=None):
        """Sends bytes of a call as far as the flow control windows allow. Returns False if the stream ended first or
        the time is over.
        """
        view, until = memoryview(body), until or time.monotonic() + self.timeout
        if not len(view) and end:
            self.send(data_head(0, END_STREAM, stream))
        while len(view):
            if stream in self.ended:
                return False
            size = min(len(view), PIECE, self.send_window, self.stream_windows[stream])
            if size <= 0:
                if not self.step(until):
                    return False
                continue
            last = end and size == len(view)
            self.send(data_head(size, END_STREAM if last else 0, stream) + view[:size])
            self.send_window -= size
            self.stream_windows[stream] -= size
            view = view[size:]
        return True

    def step(self, until):
        """Waits for received bytes and handles them. Returns False if the time is over."""
        if not self.wait(False, until - time.monotonic())[0]:
            return time.monotonic() < until
        self.receive()
        self.handle()
        self.answer()
        return True

    def finish(self, stream, timeout=None):
        """Returns the Reply of a call once the call has ended, and drops the stream's state."""
        until = time.monotonic() + (timeout or self.timeout)
        try:
            while stream not in self.ended and self.step(until):
                pass
        except Closed:
            pass
        fields = self.headers.pop(stream, {})
        body = bytes(self.bodies.pop(stream, b""))
        self.stream_windows.pop(stream, None)
        if "grpc-status" in fields:
            number = int(fields["grpc-status"])
            return Reply(CODES[number] if number < len(CODES) else str(number), fields.get("grpc-message", ""), body)
        if stream in self.ended:
            self.ended.discard(stream)
            return Reply("RESET", f"HTTP status {fields.get(':status', 'none')}", body)
        return Reply("CLOSED" if self.closed else "TIMEOUT", self.goaway or "", body)

    def call(self, path, body, extra=(), timeout=None, compressed=False):
        """Makes a unary call, or a streaming call of one message, and returns its Reply."""
        until = time.monotonic() + (timeout or self.timeout)
        try:
            stream = self.start(path, extra)
            self.write(stream, message(body, compressed), until=until)
        except (Closed, TimeoutError) as error:
            return Reply("CLOSED" if self.closed else "TIMEOUT", self.goaway or str(error), b"")
        return self.finish(stream, max(until - time.monotonic(), 0.1))


def open_socket(target, timeout, receive_buffer=None):
    """Returns a connected socket, with TLS if the target has an SSL context."""
    sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        if receive_buffer:
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        sock.settimeout(timeout)
        if target.source:
            # Let connect() choose the local port, so that the ports of this address are not used up.
            sock.setsockopt(socket.IPPROTO_IP, IP_BIND_ADDRESS_NO_PORT, 1)
            sock.bind((target.source, 0))
        sock.connect((target.host, target.port))
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return target.context.wrap_socket(sock, server_hostname="localhost") if target.context else sock
    except ssl.SSLError as error:
        sock.close()
        raise Closed(str(error)) from error
    except BaseException:
        sock.close()
        raise
