"""Ctrl-C is heard, wherever the process was when it came."""

import subprocess
import sys

import pytest

UNHEARD = """
import signal, threading, time
from racecraft.serving.interrupts import wait_for_interrupt

def interrupt():
    time.sleep(0.3)  # until the main thread sleeps
    signal.pthread_kill(threading.get_ident(), signal.SIGINT)  # noted here: the main thread's sleep goes on

threading.Thread(target=interrupt).start()
try:
    wait_for_interrupt()
except KeyboardInterrupt:
    print("heard")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals reach no single thread there")
def test_a_signal_that_does_not_end_the_sleep_is_heard_soon():
    said = subprocess.run([sys.executable, "-c", UNHEARD], capture_output=True, text=True, timeout=120)
    assert said.stdout == "heard\n", said.stderr
