"""Ctrl-C and a KeyboardInterrupt of the code's own are told apart by the signals that arrive."""

import signal
import threading

import pytest

from workbench.system.processes.interrupts import STOPPING, signals_noted


@pytest.mark.parametrize("number", STOPPING)
def test_a_signal_that_python_answers_is_noted_and_the_handler_stays(number):
    before = signal.signal(number, signal.default_int_handler)
    try:
        with signals_noted() as came, pytest.raises(KeyboardInterrupt):
            signal.raise_signal(number)
        assert came()
        assert signal.getsignal(number) is signal.default_int_handler
    finally:
        signal.signal(number, before)


def test_what_the_block_raises_itself_is_no_signal():
    with signals_noted() as came, pytest.raises(KeyboardInterrupt):
        raise KeyboardInterrupt
    assert not came()


def test_a_handler_of_somebody_else_may_raise_it_and_is_left_alone():
    def theirs(number, frame):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, theirs)
    try:
        with signals_noted() as came:
            assert came()
        assert signal.getsignal(signal.SIGINT) is theirs
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_handler_that_the_block_sets_stays():
    before = signal.getsignal(signal.SIGINT)
    try:
        with signals_noted():
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)


def test_beside_the_main_thread_no_signal_arrives():
    found = []

    def beside():
        with signals_noted() as came:
            found.append(came())

    thread = threading.Thread(target=beside)
    thread.start()
    thread.join()
    assert found == [False]
