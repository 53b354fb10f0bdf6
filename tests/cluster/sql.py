"""Connections to PostgreSQL with a time limit, by psycopg2.

A limit of the server (statement_timeout) would be wrong here: it cancels a commit that waits for a standby, and PostgreSQL
then reports success although only the primary has the commit. So the client waits no longer, and drops the connection
without a cancel.
"""
import contextlib
import select
import threading
import time

try:
    import psycopg2
    import psycopg2.extensions
    import psycopg2.extras
except ImportError:
    psycopg2 = None

LIMIT = threading.local()
CONNECT_SECONDS = 3


class Unknown(Exception):
    """The connection failed or the time was over before an answer came: what was asked may have happened or not."""


def wait(connection):
    """Waits until libpq has an answer, at most until the time limit of the calling thread."""
    while True:
        state = connection.poll()
        if state == psycopg2.extensions.POLL_OK:
            return
        left = LIMIT.until - time.monotonic()
        reads, writes = ([connection.fileno()], []) if state == psycopg2.extensions.POLL_READ else ([], [connection.fileno()])
        if left <= 0 or not any(select.select(reads, writes, [], left)):
            raise TimeoutError("no answer in time")


@contextlib.contextmanager
def within(seconds):
    """Sets the time limit of this thread, and turns every loss of the connection into Unknown."""
    LIMIT.until = time.monotonic() + seconds
    try:
        yield
    except (TimeoutError, psycopg2.OperationalError, psycopg2.InterfaceError, psycopg2.errors.AdminShutdown,
            psycopg2.errors.ReadOnlySqlTransaction) as error:
        raise Unknown(str(error).strip()) from error


class Session:
    """A connection to one host. It is closed after the first Unknown."""

    def __init__(self, dsn, seconds=CONNECT_SECONDS):
        psycopg2.extensions.set_wait_callback(wait)
        with within(seconds):
            self.connection = psycopg2.connect(dsn)

    def run(self, seconds, *statements):
        """Runs statements as one transaction. Each is (text, arguments). Returns for each its rows, or the number of changed
        rows if it has none.
        """
        results = []
        try:
            with within(seconds):
                with self.connection.cursor() as cursor:
                    for text, arguments in statements:
                        cursor.execute(text, arguments)
                        results.append(cursor.fetchall() if cursor.description else cursor.rowcount)
                self.connection.commit()
        except Unknown:
            self.close()
            raise
        except psycopg2.Error:
            with within(seconds):
                self.connection.rollback()
            raise
        return results

    def close(self):
        with contextlib.suppress(psycopg2.Error, TimeoutError):
            self.connection.close()


def ask(dsn, text, *arguments, seconds=CONNECT_SECONDS):
    """Runs one statement outside of a transaction, on a connection of its own. Returns its rows."""
    session = Session(dsn, seconds)
    try:
        session.connection.autocommit = True
        with within(seconds):
            with session.connection.cursor() as cursor:
                cursor.execute(text, arguments or None)
                return cursor.fetchall() if cursor.description else []
    finally:
        session.close()
