"""A cluster whose scheduler, workers and launches prove by certificates that they
belong together.
"""

import datetime
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from sweep.errors import WorkersError
from sweep.workers.cluster import Dask
from sweep.workers.watch import Limits
from tests import runner_jobs
from tests.cluster.started import TESTS, Cluster
from tests.faults.jobs import square
from tests.lines import HERE


def certified(folder: Path) -> dict[str, str]:
    """The variables of dask for a key and a certificate, made now, which is its own
    authority.
    """
    key, now = (
        ec.generate_private_key(ec.SECP256R1()),
        datetime.datetime.now(datetime.UTC),
    )
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "cluster")])
    day = datetime.timedelta(days=1)
    made = x509.CertificateBuilder(
        name, name, key.public_key(), x509.random_serial_number(), now - day, now + day
    )
    authority = made.add_extension(
        x509.BasicConstraints(ca=True, path_length=None), critical=True
    )
    signed = authority.sign(key, hashes.SHA256())
    plain = serialization.NoEncryption()
    secret = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, plain
    )
    (folder / "key.pem").write_bytes(secret)
    (folder / "cert.pem").write_bytes(signed.public_bytes(serialization.Encoding.PEM))
    files = {"ca-file": "cert.pem"}
    for role in ("scheduler", "worker", "client"):
        files |= {f"{role}.key": "key.pem", f"{role}.cert": "cert.pem"}
    prefix = "DASK_DISTRIBUTED__COMM__TLS__"
    return {
        f"{prefix}{what.replace('.', '__').replace('-', '_').upper()}": str(
            folder / file
        )
        for what, file in files.items()
    }


@pytest.mark.slow
def test_a_launch_uses_the_keys_of_dasks_configuration_and_has_no_other_way_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import dask.config

    keys = certified(tmp_path) | {"DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION": "True"}
    made = Cluster(tmp_path, TESTS | keys, protocol="tls")
    try:
        made.start_worker("--nanny")
        plain = Dask(made.address.replace("tls:", "tcp:"))
        for refused in (Dask(made.address), plain):
            monkeypatch.setattr("sweep.workers.cluster.CONNECT_SECONDS", 1.0)
            with pytest.raises(
                WorkersError,
                match=r"no connection can be made|no dask scheduler answers",
            ):
                refused.connect()
        ours = {
            "ca-file": "cert.pem",
            "client.key": "key.pem",
            "client.cert": "cert.pem",
        }
        with dask.config.set(
            {
                f"distributed.comm.tls.{name}": str(tmp_path / file)
                for name, file in ours.items()
            }
        ):
            launch = Dask(made.address)
            try:
                results = runner_jobs.run_all(
                    range(6), square, launch, limits=Limits(deadline=60.0)
                )
            finally:
                launch.stop()
    finally:
        made.end()
    assert made.address.startswith(f"tls://{HERE}:")
    assert sorted(results) == [(job, job * job) for job in range(6)]
