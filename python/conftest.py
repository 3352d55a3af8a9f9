"""The virtual gripper for all tests."""

import pytest
from virtual import Virtual

#: What is gripped is lifted, carried, and taken away on the way.
STORY = """
[[step]]
when = { event = "holding" }
after_s = 0.5
arm = "lift"
accel_m_s2 = 2.0

[[step]]
arm = "carry"
accel_m_s2 = 2.0

[[step]]
after_s = 0.3
object = "pull out"
"""


@pytest.fixture
def serve(tmp_path):
    """Starts virtual grippers, and checks afterwards that each ends well."""
    running = []

    def start(*arguments: str, script: str | None = None) -> Virtual:
        if script is not None:
            file = tmp_path / f"script{len(running)}.toml"
            file.write_text(script)
            arguments = (*arguments, "--script", str(file))
        running.append(Virtual(*arguments))
        return running[-1]

    yield start
    for gripper in running:
        gripper.stop()


@pytest.fixture
def patient(monkeypatch):
    """minimalmodbus asks once. A machine that keeps the gripper from running for 100 ms gets no answer: ask again."""
    import minimalmodbus

    once = minimalmodbus.Instrument._communicate

    def ask(self, *arguments):
        for _ in range(4):
            try:
                return once(self, *arguments)
            except minimalmodbus.NoResponseError:
                pass
        return once(self, *arguments)

    monkeypatch.setattr(minimalmodbus.Instrument, "_communicate", ask)


@pytest.fixture
def story(serve, tmp_path):
    """One behind a link, whose object is lost while it is carried. All of it must have happened in the end."""
    gripper = serve("--tty", str(tmp_path / "gripper"), script=STORY)
    yield gripper
    gripper.in_order(
        "a client has opened it",
        "holding",
        "the arm is lifted",
        "the arm goes sideways",
        "the object is pulled out",
        "LOST",
        "acknowledged",
    )
    assert not gripper.said("FAULT"), gripper.lines
