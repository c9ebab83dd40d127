"""How a run ends that is asked to: it says once what becomes of its running jobs, and never hangs.

Snakemake's handler of SIGTERM waits for a lock that the interrupted thread itself may hold. It
repeats its sentence whenever a job ends, and takes jobs that it has given up for failed ones.
"""

import logging
import signal
import threading

FINISHING = "Will exit after finishing currently running jobs"  # how Snakemake's sentences begin
GIVING_UP = "Terminating processes on user request"
WORDS = {
    FINISHING: "Stopping: the running jobs are finished, no other begins. Ctrl-C gives them up.",
    GIVING_UP: "Stopped: the running jobs are given up, what was finished is kept.",
}


class StopWords(logging.Filter):
    """Of the logger of Snakemake: says what SIGTERM does, and SIGINT, which is Ctrl-C."""

    def __init__(self):
        super().__init__()
        self._said: set[str] = set()

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a record is shown; the first about a signal has other words then."""
        for begin, words in WORDS.items():
            if record.getMessage().startswith(begin):
                repeated = begin in self._said
                self._said.add(begin)
                record.msg, record.args = words, ()
                return not repeated
        return GIVING_UP not in self._said or record.levelno < logging.ERROR


def listen(logger: logging.Logger) -> None:
    """Have a run of Snakemake say what signals do, and its handler of SIGTERM in another thread."""
    logger.addFilter(StopWords())
    handler = signal.getsignal(signal.SIGTERM)
    if callable(handler):
        signal.signal(
            signal.SIGTERM, lambda *given: threading.Thread(target=handler, args=given).start()
        )
