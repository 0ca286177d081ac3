"""A lock on a study, or on one shard of a study, by claims that expire.

    <study>/lock/<token>.json   the owner, the shard, and the state: asking or held;
                                touched as a sign of life

A launch that needs a study, or a shard, writes a claim in the state asking, and then
lists all claims. A claim on the whole study excludes every claim. A claim on a shard
excludes claims on this shard, and on the shards of a different division. The launch
then decides:

- If an excluding claim is held, the launch withdraws its claim and ends with an error.
- If an excluding claim is asking, the larger token withdraws and tries again later. The
  smaller token waits until the larger token is gone or held.
- Without an excluding claim, the claim is held.

Safety: of two claims that exclude each other, at most one is ever held. Each owner
writes a claim before the listing. So the owner of the later claim sees the earlier
claim, and continues only when the earlier claim is gone. Progress: the owner of the
smallest token waits only for owners that do not wait in return. The location must
guarantee only that a listing shows all earlier writes.

A claim names its owner. The claim of a dead owner is deleted by its token. An owner on
this machine lives as long as its process. An owner on another machine lives while the
time of the claim advances, or is at most STALE_SECONDS old by the clock of the
location. A clock may jump. So a claim that looks too old, or comes from the future, is
watched for WATCH_SECONDS before the owner counts as dead. An owner that was suspended
meanwhile notices that the claim is gone, and stops.
"""

import json
import logging
import os
import secrets
import threading
import time
from types import TracebackType
from typing import NamedTuple

from sweep.errors import StoreError
from sweep.store.lock_files import Claims
from sweep.store.places import StudyPlace
from sweep.store.processes import host, machine, started, user
from sweep.store.regular import parsed
from sweep.store.shares import Share

BEAT_SECONDS = 10.0
STALE_SECONDS = 60.0
WATCH_SECONDS = 15.0
POLL_SECONDS = 0.05
YIELD_SECONDS = 5.0
CLAIM_BYTES = 1000
ASKING = "asking"
HELD = "held"
SILENCE = (
    "; a launch on another machine, or before a restart, counts as ended after"
    f" {STALE_SECONDS:.0f} s of silence"
)
LOG = logging.getLogger("sweep")
GIVEN_BACK: set[str] = set()
"""Tokens of claims that this process has given up.

A claim may still exist, if the location did not answer at its deletion.
"""


class LockClaim(NamedTuple):
    """Content of a claim.

    A claim of version 0.3.0 has fewer fields, and locks the whole study.
    """

    token: str
    who: str = "somebody"
    share: str = ""
    state: str = HELD
    machine: str = ""
    process: int = 0
    started: str = ""

    def excludes(self, share: str) -> bool:
        """Return whether this claim excludes a claim of `share`, "" for all shards."""
        if not self.share or not share:
            return True
        return (
            self.share == share
            or self.share.partition("/")[2] != share.partition("/")[2]
        )


class Lock:
    """Exclusive access to a study, or to one shard of a study, for the context.

    Entering raises StoreError if another launch holds the study or the shard. The log
    reports a lock that was taken over from a dead owner.

    Parameters
    ----------
    place : StudyPlace
    share : Share, optional
        Shard to lock; by default the whole study.
    """

    def __init__(self, place: StudyPlace, share: Share | None = None) -> None:
        self.path = place.root / "lock"
        self.share = str(share) if share else ""
        self.lost = False
        self.token = ""
        self._claims: Claims = place.lock
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="lock", daemon=True)

    def __enter__(self) -> "Lock":
        try:
            self._ask()
            while not self._granted():
                time.sleep(POLL_SECONDS)
        except OSError as error:
            self._give_back()
            raise StoreError(
                f"{self.path}: cannot write ({error}); what was stored is intact"
            ) from error
        except BaseException:
            self._give_back()
            raise
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._over.set()
        self._thread.join()
        self._give_back()

    def check(self) -> None:
        """Raise StoreError if another launch has taken the lock over.

        A launch can lose the lock while its machine sleeps.
        """
        if self.lost:
            raise StoreError(
                f"{self.path}: another launch has taken this study over;"
                " finished trials are stored"
            )

    def _ask(self) -> None:
        """Write a new claim, with a new token: the old claim may have been deleted."""
        self.token = secrets.token_hex(8)
        self._claims.create(self.token, self._text(ASKING))

    def _give_back(self) -> None:
        self._claims.withdraw(self.token)
        GIVEN_BACK.add(self.token)

    def _text(self, state: str) -> str:
        """Return the text of the claim, padded to CLAIM_BYTES bytes."""
        return json.dumps(_owner() | {"share": self.share, "state": state}).ljust(
            CLAIM_BYTES
        )

    def _granted(self) -> bool:
        """Return whether the claim is held, because no other claim excludes it.

        Raises StoreError if an excluding claim is held.
        """
        rivals = self._rivals()
        for rival in rivals:
            if rival.state == HELD:
                target = (
                    f"shard {rival.share} of this study"
                    if rival.share
                    else "this study"
                )
                way_out = "wait, or end that launch" + (
                    "" if rival.machine == machine() else SILENCE
                )
                raise StoreError(
                    f"{self.path}: {target} is being launched by {rival.who}; {way_out}"
                )
        if not rivals:
            if self._claims.update(self.token, self._text(HELD)):
                return True
            self._ask()
        elif rivals[0].token < self.token:
            self._give_back()
            self._let_pass(
                [rival.token for rival in rivals if rival.token < self.token]
            )
            self._ask()
        return False

    def _rivals(self) -> list[LockClaim]:
        """Return the excluding claims with live owners, sorted by token.

        Claims of dead owners are deleted.
        """
        rivals = []
        for token in self._claims.tokens():
            claim = None if token == self.token else self._read(token)
            if claim is None or not claim.excludes(self.share):
                continue
            death = self._death(claim)
            if self._claims.text(token) is None:  # gone meanwhile
                continue
            if death:
                self._claims.evict(token)
                LOG.warning("%s: taken over from %s: %s", self.path, claim.who, death)
            else:
                rivals.append(claim)
        return rivals

    def _read(self, token: str) -> LockClaim | None:
        """Return a claim; None if the claim is gone.

        A file that lost its content in a power cut is a claim without an owner.
        """
        text = self._claims.text(token)
        if text is None:
            return None
        try:
            content = parsed(text.encode(), {})
        except ValueError:
            return LockClaim(token)
        fields = {
            name: content[name] for name in LockClaim._fields[1:] if name in content
        }
        kinds = {
            name: type(default) for name, default in LockClaim._field_defaults.items()
        }
        if not all(isinstance(value, kinds[name]) for name, value in fields.items()):
            return LockClaim(token)
        return LockClaim(token, **fields)

    def _let_pass(self, tokens: list[str]) -> None:
        """Wait until each of these claims is held or gone.

        The wait ends after YIELD_SECONDS, because an owner may die while asking.
        """
        end = time.monotonic() + YIELD_SECONDS
        while time.monotonic() < end:
            claims = [self._read(token) for token in tokens]
            if not any(claim and claim.state == ASKING for claim in claims):
                return
            time.sleep(POLL_SECONDS)

    def _death(self, claim: LockClaim) -> str:
        """Return the evidence that the owner is dead; empty if the owner may live."""
        if claim.token in GIVEN_BACK:
            return "that launch is over"
        if claim.machine == machine():
            return (
                ""
                if started(int(claim.process)) == claim.started
                else "that process is gone"
            )
        # Just touched, the own claim has the present time by the location's clock.
        self._claims.touch(self.token)
        now = self._claims.touched(self.token)
        then = self._claims.touched(claim.token)
        if now is None or then is None:
            return ""
        age = (now - then) / 1e9
        if abs(age) <= STALE_SECONDS or _is_touched(self._claims, claim.token):
            return ""
        return (
            f"without a sign of life for {age:.0f} s"
            if age > 0
            else "without a sign of life"
        )

    def owners(self) -> list[str]:
        """Return the owners of held claims, as far as a read-only check shows.

        The call writes no file and deletes no claim. The clock of this machine decides
        whether an owner on another machine lives.
        """
        claims = [self._read(token) for token in self._claims.tokens()]
        return [
            claim.who
            for claim in claims
            if claim and claim.state == HELD and self._may_live(claim)
        ]

    def _may_live(self, claim: LockClaim) -> bool:
        if claim.machine == machine():
            return started(int(claim.process)) == claim.started
        then = self._claims.touched(claim.token)
        return then is not None and abs(time.time_ns() - then) / 1e9 <= STALE_SECONDS

    def _beat(self) -> None:
        while not self.lost and not self._over.wait(BEAT_SECONDS):
            try:
                self.lost = not self._claims.touch(self.token)
            except (OSError, StoreError):
                continue  # the server may answer at the next beat


def _owner() -> dict[str, object]:
    name = host()
    process = os.getpid()
    login = user()
    since = time.strftime("%Y-%m-%d %H:%M:%S %Z")
    return {
        "host": name,
        "process": process,
        "user": login,
        "since": since,
        "who": f"{login} on {name} (process {process}) since {since}",
        "machine": machine(),
        "started": started(process) or "",
    }


def _is_touched(claims: Claims, token: str) -> bool:
    """Return whether a claim is touched or deleted within WATCH_SECONDS."""
    before = claims.touched(token)
    end = time.monotonic() + WATCH_SECONDS
    while time.monotonic() < end:
        time.sleep(min(0.5, WATCH_SECONDS / 10))
        if claims.touched(token) != before:
            return True
    return False
