"""One call of a job's function, and how functions, jobs and results become bytes."""

from __future__ import annotations

import importlib
import pickle
import traceback
from collections.abc import Callable
from typing import Any, NamedTuple

from tumble._errors import TumbleError

PROTOCOL = 5


class JobError(TumbleError, RuntimeError):
    """A job has no result: its function raised, or its workers died more often than ``retries``. The exception of the function is the cause.

    number: which job, from 0.
    """

    def __init__(self, text: str, number: int = 0) -> None:
        super().__init__(text, number)
        self.number = number

    def __str__(self) -> str:
        return str(self.args[0])


class Outcome(NamedTuple):
    """What a call left: the pickled result, or the pickled exception and its traceback; ``payload`` is None if its worker was lost."""

    ok: bool
    payload: bytes | None
    text: str


def pack(value: object) -> bytes:
    """Pickles a value; functions and classes of a script by value, where ``cloudpickle`` is installed, as it is with Ray and Dask."""
    try:
        cloudpickle = importlib.import_module("cloudpickle")
    except ImportError:
        return pickle.dumps(value, PROTOCOL)
    packed: bytes = cloudpickle.dumps(value, PROTOCOL)
    return packed


def packed_result(value: object) -> bytes:
    """Pickles a result: by the standard module where it can, which gives the same bytes with any engine."""
    try:
        return pickle.dumps(value, PROTOCOL)
    except (pickle.PicklingError, AttributeError, TypeError):
        return pack(value)


def call(function: Callable[[Any], Any], job: Any) -> Outcome:
    """Calls a function for a job."""
    try:
        return Outcome(True, packed_result(function(job)), "")
    except Exception as error:
        text = traceback.format_exc()
        try:
            payload = packed_result(error)
            pickle.loads(payload)  # some exceptions pickle and cannot be read again
        except Exception:
            payload = packed_result(RuntimeError(f"{type(error).__name__}: {error}"))
        return Outcome(False, payload, text)


def call_packed(function: bytes, job: bytes) -> Outcome:
    """Calls a pickled function for a pickled job, in another process."""
    try:
        unpacked = pickle.loads(function), pickle.loads(job)
    except Exception as error:
        return Outcome(False, pickle.dumps(RuntimeError(f"the job cannot be read there: {error}")), traceback.format_exc())
    return call(*unpacked)


def error_of(number: int, outcome: Outcome) -> JobError:
    """Returns the error of a job without result."""
    if outcome.payload is None:
        return JobError(f"job {number}: {outcome.text}", number)
    cause = pickle.loads(outcome.payload)
    error = JobError(f"job {number}: {type(cause).__name__}: {cause}\n\nThere:\n{outcome.text}", number)
    error.__cause__ = cause
    return error
