"""UDP ports of this machine at which nobody listens."""

import socket
from contextlib import ExitStack


def free_ports(number):
    """So many ports, all different."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(number)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]
