#!/usr/bin/env python3
"""A web server of one folder for check-cloud: python3 check-cloud-server.py FOLDER MANNER [PORT]; it prints its port.

Manners: `ranges` behaves well, `whole` knows no ranges, `busy` refuses every tenth request with 503 and Retry-After,
`breaks` ends every tenth answer in the middle, `slow` waits 50 ms before each answer. GET /count/requests tells how
many requests there were, GET /count/bytes how many bytes were sent.
"""

import http.server
import itertools
import os
import re
import sys
import threading
import time
from urllib.parse import unquote

folder, manner = os.path.realpath(sys.argv[1]), sys.argv[2]
port = int(sys.argv[3]) if len(sys.argv) > 3 else 0
numbers = itertools.count(1)
lock = threading.Lock()
counts = {"requests": 0, "bytes": 0}


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def plain(self, status, body=b"", **headers):
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def do_GET(self):
        if self.path.startswith("/count/"):
            return self.plain(200, str(counts[self.path.rsplit("/", 1)[1]]).encode())
        number = next(numbers)
        with lock:
            counts["requests"] += 1
        if manner == "busy" and number % 10 == 0:
            return self.plain(503, b"too much to do", Retry_After="1")
        if manner == "slow":
            time.sleep(0.05)
        path = os.path.realpath(folder + unquote(self.path.split("?")[0]))
        if not path.startswith(folder + os.sep) or not os.path.isfile(path):
            return self.plain(404, b"there is no such file")
        size = os.path.getsize(path)
        tag = f'"{size}-{os.stat(path).st_mtime_ns}"'
        if self.headers.get("If-Match", tag) != tag:
            return self.plain(412, b"it has changed")
        start, end, status = 0, size, 200
        found = re.fullmatch(r"bytes=(\d+)-(\d+)", self.headers.get("Range", ""))
        if found and manner != "whole":
            start, end, status = int(found[1]), min(int(found[2]) + 1, size), 206
            if start >= size:
                return self.plain(416)
        self.send_response(status)
        self.send_header("ETag", tag)
        self.send_header("Last-Modified", self.date_time_string(os.path.getmtime(path)))
        if status == 206:
            self.send_header("Content-Range", f"bytes {start}-{end - 1}/{size}")
        self.send_header("Content-Length", str(end - start))
        self.end_headers()
        stop = end
        if manner == "breaks" and number % 10 == 0:
            stop = (start + end) // 2
        with open(path, "rb") as file:
            file.seek(start)
            left = stop - start
            while left > 0:
                block = file.read(min(left, 1 << 18))
                try:
                    self.wfile.write(block)
                except OSError:
                    self.close_connection = True
                    return
                left -= len(block)
                with lock:
                    counts["bytes"] += len(block)
        if stop < end:
            self.close_connection = True


class Server(http.server.ThreadingHTTPServer):
    request_queue_size = 64
    daemon_threads = True

    def handle_error(self, *_):
        """Clients that hang up are no news."""


server = Server(("127.0.0.1", port), Handler)
print(server.server_address[1], flush=True)
server.serve_forever()
