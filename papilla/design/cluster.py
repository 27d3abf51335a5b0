"""Workers of a Dask scheduler. Who reaches an open scheduler runs any code as the user of its workers and clients, so
the connection is encrypted, and both sides prove by certificates who they are."""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from papilla.core.errors import InputError, MissingExtraError
from papilla.core.outside import read_bytes
from papilla.design.batch import refuse_version
from papilla.design.texts import line, short

if TYPE_CHECKING:
    from distributed.security import Security

ANSWER_S = 20
"""Seconds within which a scheduler answers."""
ADDRESS_LETTERS = 300
PEM_BYTES = 2**20
"""Most letters of an address, and bytes of a file of certificates."""


@dataclass(frozen=True)
class Scheduler:
    """A Dask scheduler: its address, the files (PEM) that prove who is who, and whether it may do without.

    ca : certificate of the authority that signed those of scheduler, workers and this client. cert, key : of this
    client. Raises `InputError` unless the address is tls:// with these files, or tcp:// and `insecure`.
    """

    address: str
    ca: Path | None = None
    cert: Path | None = None
    key: Path | None = None
    insecure: bool = False

    def __post_init__(self) -> None:
        protocol, separator, _ = self.address.partition("://")
        address = short(line(self.address))
        if not self.address.isprintable() or not 0 < len(self.address) <= ADDRESS_LETTERS:
            raise InputError(f"--scheduler must be an address such as tls://host:8786, got {address!r}")
        if separator and protocol not in ("tls", "tcp"):
            raise InputError(f"--scheduler must be an address that begins with tls://, got {address}")
        if self.encrypted and self.insecure:
            raise InputError("--insecure is for a scheduler without encryption, and tls:// has it: give one of them")
        if self.encrypted and None in self.files:
            raise InputError(f"{address} needs --tls-ca, --tls-cert and --tls-key: certificates that prove who is who")
        if not self.encrypted and any(self.files):
            raise InputError(
                f"--tls-ca, --tls-cert and --tls-key need an address that begins with tls://, got {address}"
            )
        if not self.encrypted and not self.insecure:
            raise InputError(
                f"{address} is open: whoever reaches it runs code as you. Give tls://host:port with --tls-ca, "
                "--tls-cert and --tls-key, or --insecure if you trust everybody in its network"
            )

    @property
    def encrypted(self) -> bool:
        """Whether the connection is encrypted, and both sides prove who they are."""
        return self.address.startswith("tls://")

    @property
    def files(self) -> tuple[Path | None, Path | None, Path | None]:
        """Authority, certificate and key."""
        return self.ca, self.cert, self.key


@contextmanager
def cluster(scheduler: Scheduler) -> Iterator[tuple[Executor, int, str]]:
    """Executor, number of workers, and a description of a scheduler's workers.

    Raises `MissingExtraError` without Dask, `InputError` if the scheduler does not answer, its files of certificates
    cannot be used, or its workers have another version.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingExtraError('--scheduler needs Dask: pip install "papilla[cluster]"') from error
    security = _security(scheduler)
    try:
        client = Client(scheduler.address, timeout=ANSWER_S, security=security)
    except (OSError, TimeoutError, ValueError) as error:
        why = short(line(error), 300)
        raise InputError(f"no Dask scheduler answers at {short(scheduler.address)}: {why}") from error
    try:
        _refuse_other_versions(client)
        count = max(1, sum(client.nthreads().values()))
        open_ = "" if scheduler.encrypted else ", not encrypted"
        yield client.get_executor(pure=False), count, f"Dask {short(scheduler.address)}{open_}"
    finally:
        client.close()


def _security(scheduler: Scheduler) -> "Security":
    """Dask's settings for a connection."""
    from distributed.security import Security

    if not scheduler.encrypted:
        return Security(require_encryption=False)
    for path in scheduler.files:
        if path is not None:
            read_bytes(path, "certificate", PEM_BYTES)
    ca, cert, key = map(str, scheduler.files)
    security = Security(require_encryption=True, tls_ca_file=ca, tls_client_cert=cert, tls_client_key=key)
    try:
        security.get_connection_args("client")
    except (OSError, ValueError) as error:
        raise InputError(f"{ca}, {cert} and {key} are no certificates and key that fit: {line(error)}") from error
    return security


def _refuse_other_versions(client: Any) -> None:
    """Raise `InputError` if a worker has another version; the function is sent by value, because it may not exist
    there."""

    def theirs() -> str:
        try:
            from papilla.design.batch import version
        except ImportError:
            import importlib.metadata

            return f"{importlib.metadata.version('papilla')} (without studies)"
        return version()

    for worker, worker_version in client.run(theirs, on_error="return").items():
        refuse_version(f"worker {worker}", str(worker_version))
