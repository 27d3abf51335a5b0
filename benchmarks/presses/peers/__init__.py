"""One press by other libraries, and its cost: FElupe and NGSolve on the same mesh, in the same run."""

from benchmarks.presses.peers.runner import PeerPress, missing_peers, run_peers

__all__ = ["PeerPress", "missing_peers", "run_peers"]
