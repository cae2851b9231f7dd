"""A network that can be cut."""

from __future__ import annotations

import socket
import threading
from contextlib import suppress

from tests.processes import free_endpoint


class Cable:
    """A TCP connection to somewhere; while it is cut, what is sent waits, as it does in the kernel."""

    def __init__(self, endpoint: str) -> None:
        self.endpoint = free_endpoint()
        self._to = self._address(endpoint)
        self.whole = threading.Event()
        self.whole.set()
        self._ends: list[socket.socket] = []
        self._server = socket.create_server(self._address(self.endpoint))
        self._threads = [threading.Thread(target=self._accept)]
        self._threads[0].start()

    @staticmethod
    def _address(endpoint: str) -> tuple[str, int]:
        host, _, port = endpoint.removeprefix("tcp/").partition(":")
        return host, int(port)

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._server.accept()
                far = socket.create_connection(self._to)
                self._ends += [near, far]
                for pair in ((near, far), (far, near)):
                    self._threads.append(threading.Thread(target=self._pass_on, args=pair))
                    self._threads[-1].start()

    def _pass_on(self, source: socket.socket, target: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(4096):
                self.whole.wait()
                target.sendall(data)

    def close(self) -> None:
        self.whole.set()
        for end in (self._server, *self._ends):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()
        for thread in self._threads:
            thread.join()
