"""Signals to a run: what is said, once, and that the run goes on to its end."""

import logging
import os
import signal
import threading

from viscotrain.jobs import stopping


def shown(*messages: tuple[int, str]) -> list[str]:
    """What a logger of Snakemake shows of messages with these levels."""
    words, found = stopping.StopWords(), []
    for level, text in messages:
        record = logging.LogRecord("snakemake", level, "", 0, text, None, None)
        if words.filter(record):
            found.append(record.getMessage())
    return found


def test_a_signal_is_spoken_of_once_in_plain_words():
    finishing = (logging.INFO, f"{stopping.FINISHING} (scheduler).")
    failed = (logging.ERROR, "Error in rule dns_1")
    said = stopping.WORDS[stopping.FINISHING]
    assert shown(finishing, finishing, failed, finishing) == [said, "Error in rule dns_1"]
    assert shown(failed) == ["Error in rule dns_1"]


def test_jobs_that_are_given_up_are_no_failed_ones():
    stopped = (logging.INFO, f"{stopping.GIVING_UP}, this might take some time.")
    failed, ended = (logging.ERROR, "Error in rule dns_1"), (logging.INFO, "Complete log")
    assert shown(stopped, failed, ended) == [stopping.WORDS[stopping.GIVING_UP], "Complete log"]


def test_a_handler_that_waits_for_a_lock_of_the_interrupted_thread_gets_it():
    lock, got = threading.Lock(), []
    before = signal.signal(signal.SIGTERM, lambda *_: got.append(lock.acquire(timeout=5)))
    try:
        stopping.listen(logging.Logger("run"))
        with lock:
            os.kill(os.getpid(), signal.SIGTERM)
        for thread in threading.enumerate():
            if thread is not threading.current_thread() and not thread.daemon:
                thread.join()
    finally:
        signal.signal(signal.SIGTERM, before)
    assert got == [True]
