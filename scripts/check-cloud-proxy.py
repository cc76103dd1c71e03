#!/usr/bin/env python3
"""A proxy before a store, for check-cloud-output: python3 check-cloud-proxy.py PORT-OF-STORE MANNER; it prints its port.

Manners: `plain` passes everything on, `slow` waits 0.2 s before each answer, `busy` refuses every tenth request with 503,
`breaks` ends every tenth connection without an answer after the store has done the request, `mute-N` never answers the
Nth request that begins an upload, though the store has begun it, `forgets` answers the first request to complete an
upload with 404, after the store has given it up.
"""

import http.client
import http.server
import itertools
import sys
import threading
import time
from urllib.parse import urlsplit

store, manner = int(sys.argv[1]), sys.argv[2]
numbers, begins = itertools.count(1), itertools.count(1)
forgot = threading.Event()


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def plain(self, status, body=b"", headers=()):
        self.send_response(status)
        for name, value in headers:
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def ask(self, command, body=None):
        there = http.client.HTTPConnection("127.0.0.1", store, timeout=60)
        headers = {k: v for k, v in self.headers.items() if k.lower() not in ("host", "connection")}
        there.request(command, self.path, body, headers | {"Host": self.headers["Host"]})
        answer = there.getresponse()
        return answer, answer.read()

    def any(self):
        number = next(numbers)
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        if manner == "busy" and number % 10 == 0:
            return self.plain(503, b"too much to do", [("Retry-After", "1")])
        if manner == "slow":
            time.sleep(0.2)
        query = urlsplit(self.path).query
        completes = self.command == "POST" and "uploadId=" in query
        if manner == "forgets" and completes and not forgot.is_set():
            forgot.set()
            self.ask("DELETE")
            return self.plain(404, b"<Error><Code>NoSuchUpload</Code></Error>")
        answer, text = self.ask(self.command, body)
        if self.command == "POST" and query.startswith("uploads") and manner == f"mute-{next(begins)}":
            time.sleep(600)
        if manner == "breaks" and number % 10 == 0:
            self.close_connection = True
            return self.connection.close()
        left = ("content-length", "transfer-encoding", "connection", "server", "date")
        headers = [(k, v) for k, v in answer.getheaders() if k.lower() not in left]
        if self.command != "HEAD":
            return self.plain(answer.status, text, headers)
        self.send_response(answer.status)
        for name, value in headers + [("Content-Length", answer.getheader("Content-Length") or "0")]:
            self.send_header(name, value)
        self.end_headers()

    do_GET = do_HEAD = do_PUT = do_POST = do_DELETE = any


class Server(http.server.ThreadingHTTPServer):
    request_queue_size = 64
    daemon_threads = True

    def handle_error(self, *_):
        """Clients that hang up are no news."""


server = Server(("127.0.0.1", 0), Handler)
print(server.server_address[1], flush=True)
server.serve_forever()
