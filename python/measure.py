"""How soon the virtual gripper answers, and whether its ticks stay on time.

python measure.py [SECONDS]: lets it run without a client, and polls on both kinds of port, for so long each (60): flat out on the
pseudo-terminal and 500 times a second on TCP. What is late without a client is the machine's doing: it should have nothing
else to do. Needs pyserial.
"""

import socket
import sys
import tempfile
import time

import serial
from virtual import Virtual

sys.path.insert(0, "clients")
from compatible import read_frame  # noqa: E402

REQUEST, ANSWER = read_frame(6), 17


def measure(what: str, virtual: Virtual, ask, seconds: float, period_s: float) -> None:
    """Asks for so long, and says how it went."""
    times_ms, missing = [], 0
    due = time.monotonic()
    end = due + seconds
    while due < end:
        time.sleep(max(0.0, due - time.monotonic()))
        begin = time.perf_counter()
        missing += not ask()
        times_ms.append(1e3 * (time.perf_counter() - begin))
        due = max(due + period_s, time.monotonic() - 0.1) if period_s else time.monotonic()
    times_ms.sort()
    at = [times_ms[int(share * (len(times_ms) - 1))] for share in (0.5, 0.99, 0.999, 1.0)]
    print(
        f"{what}: {len(times_ms) / seconds:.0f} requests a second for {seconds:.0f} s, {missing} without an answer; "
        "answered within {:.1f} ms (median), {:.1f} (99 %), {:.1f} (99.9 %), {:.1f} (all)".format(*at)
    )
    virtual.stop()
    print("   ", virtual.lines[-1])


def main() -> None:
    seconds = float(sys.argv[1]) if sys.argv[1:] else 60.0
    virtual = Virtual()
    time.sleep(seconds)
    virtual.stop()
    print(f"no client:\n    {virtual.lines[-1]}")

    with tempfile.TemporaryDirectory() as folder:
        virtual = Virtual("--tty", f"{folder}/gripper")
        line = serial.Serial(virtual.port, 115_200, timeout=1)

        def over_serial() -> bool:
            line.write(REQUEST)
            return len(line.read(ANSWER)) == ANSWER

        measure("pseudo-terminal, flat out", virtual, over_serial, seconds, 0)

    virtual = Virtual("--tcp", "127.0.0.1:0")
    host, port = virtual.port.rsplit(":", 1)
    stream = socket.create_connection((host, int(port)), timeout=1)
    stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def over_tcp() -> bool:
        stream.sendall(REQUEST)
        received = b""
        try:
            while len(received) < ANSWER:
                received += stream.recv(ANSWER - len(received))
        except TimeoutError:
            return False
        return True

    measure("TCP, 500 a second", virtual, over_tcp, seconds, 1 / 500)


if __name__ == "__main__":
    main()
