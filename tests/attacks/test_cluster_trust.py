"""What the guide admits of dask: whoever sends a message of it runs code where that is
read.
"""

from pathlib import Path

from distributed.protocol import deserialize, serialize

from tests.attacks.test_storages import Payload


def test_dask_itself_unpickles_what_a_worker_sends(tmp_path: Path) -> None:
    """So an unpickler of ours for results, however narrow, keeps no hostile worker out
    of the launching process.
    """
    trap = tmp_path / "trap"
    header, frames = serialize(Payload(trap))
    assert header["serializer"] == "pickle"
    assert not trap.exists()
    deserialize(header, frames)
    assert trap.exists()
