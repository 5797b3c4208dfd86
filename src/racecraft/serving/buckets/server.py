"""Folders of this machine behind an S3 address: `http://127.0.0.1:9000`, path style. Begin with `BucketServer`.

Only this machine is served, and no page of a browser: a request that names another host or says which page it comes
from is refused, so that no web site reaches the folders through the visitor's own browser. Who may ask beyond that is
up to `keys`: without any, every signature is taken, for old notebooks bring keys of their own; with some, only theirs.
"""

from __future__ import annotations

import datetime
import threading
from collections.abc import Iterator, Mapping
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import parse_qsl, unquote, urlsplit

from racecraft.contract.errors import UserInputError
from racecraft.serving.buckets.answers import Answer, Asked, answer
from racecraft.serving.buckets.bodies import BrokenBodyError, body_pieces
from racecraft.serving.buckets.bucket_folder import BucketFolder
from racecraft.serving.buckets.signature import require_signed
from racecraft.serving.buckets.xml import S3Error
from racecraft.serving.port import LOOPBACK, port_error

IDLE_SECONDS = 120.0
_OURSELVES = ("127.0.0.1", "localhost", "[::1]")
_BLOCK = 1 << 18


class BucketServer:
    """Serves folders, in threads of its own.

    Args:
        folders: By the name that the bucket has.
        keys: Secrets by the name of their key; none: every request is taken.

    Raises:
        UserInputError: A folder is none.
    """

    def __init__(self, folders: Mapping[str, Path], keys: Mapping[str, str] | None = None) -> None:
        for path in folders.values():
            if not path.is_dir():
                raise UserInputError(f"{path}: there is no such folder; expected one to serve as a bucket.")
        self._buckets = {name: BucketFolder(path, name) for name, path in folders.items()}
        self._keys = dict(keys or {})
        self._server: _Server | None = None

    def start(self, port: int = 0) -> str:
        """Begin to serve; return the address.

        Raises:
            PortError: The port cannot be listened on.
        """
        try:
            self._server = _Server((LOOPBACK, port), self._buckets, self._keys)
        except (OSError, OverflowError) as error:
            raise port_error(LOOPBACK, port, error) from error
        threading.Thread(target=self._server.serve_forever, name="racecraft-buckets", daemon=True).start()
        return f"http://{LOOPBACK}:{self._server.server_address[1]}"

    def close(self) -> None:
        """Stop; closing twice is closing once."""
        if self._server is not None:
            self._server.shutdown()
            self._server.server_close()
            self._server = None


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    request_queue_size = 128

    def __init__(self, address: tuple[str, int], buckets: Mapping[str, BucketFolder], keys: Mapping[str, str]) -> None:
        self.buckets, self.keys = buckets, keys
        super().__init__(address, _Handler)

    def handle_error(self, request: object, client_address: object) -> None:
        """Say nothing of a client that has gone."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "racecraft", ""
    timeout = IDLE_SECONDS
    server: _Server

    def handle_one_request(self) -> None:
        """Read a request and answer it, whatever its method."""
        self.raw_requestline = self.rfile.readline(65537)
        if not self.raw_requestline or len(self.raw_requestline) > 65536:
            self.close_connection = True
            return
        if not self.parse_request():
            return
        headers = {name.lower(): value for name, value in self.headers.items()}
        body = body_pieces(self.rfile, headers)
        resource = urlsplit(self.path).path
        try:
            found = self._answer(headers, body, resource)
        except S3Error as error:
            self.close_connection = self.close_connection or isinstance(error, BrokenBodyError)
            found = Answer(error.status, error.body(resource), {"Content-Type": "application/xml"})
        except (ConnectionError, TimeoutError):
            self.close_connection = True
            return
        except Exception as error:  # never let one request take the server down
            text = S3Error(500, "InternalError", f"{type(error).__name__}: {str(error)[:200]}").body(resource)
            found = Answer(500, text, {"Content-Type": "application/xml"})
            self.close_connection = True
        self._pass_over(body)
        self._send(found)

    def _answer(self, headers: Mapping[str, str], body: Iterator[bytes], resource: str) -> Answer:
        host = headers.get("host", "").rpartition(":")[0] or headers.get("host", "")
        if host not in _OURSELVES or "origin" in headers:
            raise S3Error(403, "AccessDenied", "Only programs of this machine are served, by 127.0.0.1 or localhost.")
        query = parse_qsl(urlsplit(self.path).query, keep_blank_values=True)
        if self.server.keys:
            now = datetime.datetime.now(datetime.UTC)
            require_signed(self.command, resource, query, headers, self.server.keys, now)
        bucket, _, key = resource.lstrip("/").partition("/")
        try:
            names = unquote(bucket, errors="strict"), unquote(key, errors="strict")
        except UnicodeDecodeError:
            raise S3Error(400, "InvalidURI", "The key is no UTF-8.") from None
        return answer(self.server.buckets, Asked(self.command, *names, dict(query), headers, body))

    def _pass_over(self, body: Iterator[bytes]) -> None:
        """Read what nobody wanted of a body, so that the next request begins where it begins."""
        try:
            for _ in body:
                pass
        except (S3Error, OSError):
            self.close_connection = True

    def _send(self, found: Answer) -> None:
        length = len(found.body) if found.length is None else found.length
        try:
            self.send_response(found.status)
            for name, value in found.headers.items():
                self.send_header(name, value)
            if found.status not in (204, 304):
                self.send_header("Content-Length", str(length))
            if self.close_connection:
                self.send_header("Connection", "close")
            self.end_headers()
            if self.command == "HEAD" or found.status in (204, 304):
                return
            if found.file is None:
                self.wfile.write(found.body)
            else:
                self._send_file(found.file, found.begin, length)
        except OSError:
            self.close_connection = True

    def _send_file(self, path: Path, begin: int, length: int) -> None:
        with open(path, "rb") as file:
            file.seek(begin)
            while length > 0:
                block = file.read(min(_BLOCK, length))
                if not block:  # it was cut meanwhile: what was promised cannot be kept
                    self.close_connection = True
                    return
                length -= len(block)
                self.wfile.write(block)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing of each request."""
