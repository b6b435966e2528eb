"""Somebody else's code in processes: what it returns comes back, and what it does wrong stays there."""

from __future__ import annotations

import io
import os
import pickle
import sys
import threading
import time
from typing import Any

import psutil
import pytest

from seatruth import worker_child, workers
from seatruth.errors import PluginError
from seatruth.processes import search_path, started
from seatruth.workers import Workers, by_value

KILLED = -9 if os.name == "posix" else 1
"""The code of a process that was ended from outside: a signal, or what Windows is asked for."""


def misbehave(what: str) -> Any:
    if what == "abort":
        os.abort()
    if what == "exit":
        os._exit(3)
    if what == "sleep":
        time.sleep(60.0)
    if what == "raise":
        raise ValueError("no such thing")
    if what == "print":
        print("to the pipe?")
        sys.stdout.flush()
    return what, os.getpid()


def test_what_goes_wrong_costs_one_call() -> None:
    pool = Workers(misbehave)
    first = pool.call(("fine",), 30.0)
    assert first.value[0] == "fine"
    assert first.value[1] != os.getpid()
    assert ("SIGABRT" if os.name == "posix" else "exit code") in pool.call(("abort",), 30.0).failure
    assert "exit code 3" in pool.call(("exit",), 30.0).failure
    assert pool.call(("sleep",), 0.3).failure == "it took longer than 0.3 s"
    assert pool.call(("raise",), 30.0).failure == "it raised ValueError: no such thing"
    again = pool.call(("print",), 30.0)
    assert again.value[0] == "print"
    assert not again.failure
    assert again.value[1] == pool.call(("fine",), 30.0).value[1]  # a process that is well is used again
    pool.close()


def test_an_end_from_here_ends_what_is_at_work() -> None:
    pool = Workers(misbehave)
    assert pool.call(("fine",), 30.0).value
    answers: list[Any] = []
    thread = threading.Thread(target=lambda: answers.append(pool.call(("sleep",), 60.0)))
    thread.start()
    time.sleep(0.2)
    pool.close()
    thread.join(20.0)
    assert answers
    assert answers[0].failure
    assert pool.closed == 1
    assert pool.call(("fine",), 30.0).value  # and it can be used again
    pool.close()


def test_an_idle_process_may_end_by_itself_and_one_that_does_not_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    for patience_s, sleeps, code in ((30.0, False, 0), (0.1, True, KILLED)):
        monkeypatch.setattr(workers, "END_S", patience_s)
        pool = Workers(misbehave)
        number = pool.call(("fine",), 30.0).value[1]
        (worker,) = pool._idle
        if sleeps:
            psutil.Process(number).suspend()
        pool.close()
        assert worker._process.returncode == code


def test_what_cannot_be_sent_is_said() -> None:
    lock = threading.Lock()
    with pytest.raises(PluginError, match="cannot be sent"):
        Workers(lambda: lock)
    assert b"misbehave" in by_value(misbehave)


def test_a_function_that_cannot_be_loaded_there_is_said() -> None:
    class Bad:
        def __reduce__(self) -> Any:
            return exec, ("raise ImportError('not here')",)

    answer = Workers(Bad()).call((), 30.0)
    assert "cannot be started" in answer.failure
    assert "not here" in answer.failure


def test_the_process_answers_each_message_and_ends_with_the_pipe() -> None:
    with started(worker_child.__file__) as process:
        assert process.stdin is not None
        assert process.stdout is not None

        def ask(message: Any) -> Any:
            worker_child.send(process.stdin, message)
            return pickle.loads(worker_child.receive(process.stdout))

        first = {"modules": search_path(), "parent": os.getpid(), "function": by_value(misbehave)}
        assert ask(first) == ("ready",)
        answer, (what, number), seconds = ask(("print",))
        assert (answer, what, number) == ("done", "print", process.pid)
        assert seconds >= 0.0
        assert ask(("raise",)) == ("raised", "ValueError", "no such thing")
        process.stdin.close()
        assert process.stdout.read() == b""  # nothing that the function printed
        assert process.wait(30.0) == 0


def test_the_process_ends_where_there_is_no_function() -> None:
    first = {"modules": search_path(), "parent": os.getpid(), "function": b"no pickle"}
    with started(worker_child.__file__) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        worker_child.send(process.stdin, first)
        answer, kind, _ = pickle.loads(worker_child.receive(process.stdout))
        assert (answer, kind) == ("raised", "UnpicklingError")
        assert process.wait(30.0) == 0


def test_half_a_message_is_the_end_of_the_pipe() -> None:
    whole = io.BytesIO()
    worker_child.send(whole, "a message")
    for cut in (3, len(whole.getvalue()) - 1):
        with pytest.raises(EOFError):
            worker_child.receive(io.BytesIO(whole.getvalue()[:cut]))
    assert pickle.loads(worker_child.receive(io.BytesIO(whole.getvalue()))) == "a message"
