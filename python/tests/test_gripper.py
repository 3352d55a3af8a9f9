"""The package against the virtual gripper."""

import csv
import re
import subprocess

import pytest
from virtual import LONG, binary, until

import softgrip
from softgrip import Gripper, LossCause, Refused, RequestRejected, State, _gripper, _status
from softgrip._errors import REFUSALS
from softgrip._settings import numbers

PULLED_OUT = """
repeat = true

[[step]]
when = { event = "holding" }
after_s = 0.5
object = "pull out"

[[step]]
when = { register = 0x1010, equals = 1 }
object = "appear"
"""


@pytest.fixture
def gripper(serve, tmp_path):
    virtual = serve("--tty", str(tmp_path / "gripper"))
    with Gripper(virtual.port, timeout_s=5) as gripper:
        yield gripper


def test_it_closes_on_an_object_holds_it_and_opens(gripper):
    assert gripper.status().state == State.IDLE
    gripper.close()
    assert gripper.wait_holding(LONG)
    status = gripper.status()
    assert status.state == State.HOLDING and status.touching == (True, True, True)
    assert status.pressure_kpa == pytest.approx(140, abs=3)
    assert status.setpoint_kpa == pytest.approx(140, abs=3)
    assert all(residual > 500 for residual in status.residual_ue)
    assert status.margin_percent is None
    gripper.open(LONG)
    assert gripper.status().state == State.IDLE
    assert gripper.counters()["holds"] == 1
    assert gripper.lost() is None


def test_it_closes_at_a_pressure(gripper):
    gripper.close(pressure_kpa=120.5)
    gripper.wait_holding(LONG)
    assert gripper.status().setpoint_kpa == pytest.approx(120.5, abs=3)
    with pytest.raises(RequestRejected) as rejected:
        gripper.close(pressure_kpa=500)
    assert rejected.value.code == 3
    with pytest.raises(ValueError, match="pressure_kpa -1"):
        gripper.close(pressure_kpa=-1)
    assert gripper.status().setpoint_kpa == pytest.approx(120.5, abs=3)


def test_it_grips_a_payload_with_a_margin(gripper):
    gripper.grip_payload(mass_g=100, acceleration_m_s2=2.0)
    assert gripper.wait_holding(LONG)
    assert 0 < gripper.status().margin_percent < 100
    gripper.open(LONG)
    with pytest.raises(Refused) as refused:
        gripper.grip_payload(mass_g=5000, acceleration_m_s2=2.0)
    assert refused.value.reason == 4
    assert 100 < refused.value.detail < 1000
    with pytest.raises(ValueError, match="sphere, cylinder"):
        gripper.grip_payload(mass_g=100, acceleration_m_s2=2.0, kind="cube")


def test_it_closes_on_nothing(serve):
    virtual = serve("--tcp", "127.0.0.1:0", "--object", "none")
    with Gripper(f"tcp://{virtual.port}", timeout_s=5) as gripper:
        gripper.close()
        assert not gripper.wait_holding(LONG)
        assert gripper.status().state == State.EMPTY


def test_a_lost_object_is_told_with_its_cause_and_latched_until_it_is_acknowledged(serve, tmp_path):
    virtual = serve("--tty", str(tmp_path / "gripper"), script=PULLED_OUT)
    with Gripper(virtual.port, timeout_s=5) as gripper:
        for count in (1, 2):
            gripper.close()
            assert gripper.wait_holding(LONG)
            until("the object is lost", lambda: gripper.lost() is not None)
            loss = gripper.lost()
            assert loss.cause in LossCause
            assert loss.flagged_ms >= loss.onset_ms > 0
            assert all(abs(change) > 5 for change in loss.evidence_percent)
            assert gripper.status().lost
            with pytest.raises(Refused) as refused:
                gripper.close(100)
            assert refused.value.reason == 7
            gripper.acknowledge()
            assert gripper.lost() is None
            gripper.open(LONG)
            assert gripper.counters()["losses"] == count
            until("there is another object", lambda: virtual.lines[-1].endswith("appears"))


def test_settings_are_read_and_written_by_name_and_by_number(gripper):
    settings = gripper.settings
    assert settings["regulator.slew_kpa_per_s"] == settings[101] == 400
    settings["regulator.slew_kpa_per_s"] = 300
    assert settings[101] == 300
    with pytest.raises(RequestRejected) as rejected:
        settings["regulator.slew_kpa_per_s"] = -1
    assert rejected.value.code == 3
    with pytest.raises(KeyError, match="no such setting"):
        settings["regulator.slow"]
    assert settings[101] == 300
    assert "regulator.slew_kpa_per_s" in set(settings)
    gripper.save_settings()


def test_the_settings_are_those_of_the_gripper():
    table = subprocess.run(
        [binary(), "settings", "registers"], check=True, capture_output=True, text=True
    ).stdout
    rows = re.findall(r"^\| (\d+) \| `(.+?)` \|", table, re.MULTILINE)
    assert len(rows) > 50
    assert {name: int(number) for number, name in rows} == numbers()


def test_the_registers_are_those_of_the_gripper():
    page = subprocess.run([binary(), "registers"], check=True, capture_output=True, text=True).stdout
    rows = re.findall(r"^\| (0x[0-9A-F]{4}) \| .*? \| .*? \| (.+?) \|", page, re.MULTILINE)
    addresses = {name: int(address, 16) for address, name in rows}
    for name, address in {
        "state": _status.STATUS_AT,
        "fault": _status.STATUS_AT + 1,
        "flags": _status.STATUS_AT + 2,
        "pressure": _status.STATUS_AT + 3,
        "set-point": _status.STATUS_AT + 4,
        "bend": _status.STATUS_AT + 5,
        "level": _status.STATUS_AT + 6,
        "margin": _status.STATUS_AT + 7,
        "touching": _status.STATUS_AT + 8,
        "residual": _status.STATUS_AT + _status.STATUS_COUNT - 3,
        "loss": _status.LOSS_AT,
        "loss began": _status.LOSS_AT + 1,
        "loss reported": _status.LOSS_AT + 3,
        "loss latency": _status.LOSS_AT + 5,
        "loss evidence": _status.LOSS_AT + _status.LOSS_COUNT - 3,
        "payload mass": _gripper._PAYLOAD_AT,
        "payload acceleration": _gripper._PAYLOAD_AT + 1,
        "payload kind": _gripper._PAYLOAD_AT + 2,
        "grip pressure": _gripper._PRESSURE_AT,
        "command": _gripper._COMMAND_AT,
        "arm": _gripper._MOTION_AT,
        "result": _gripper._RESULT_AT,
        "refusal": _gripper._RESULT_AT + 1,
        "refusal detail": _gripper._RESULT_AT + 2,
        "settings": _gripper._STORED_AT,
        **{name: _gripper._COUNTERS_AT + place for place, name in enumerate(_gripper._COUNTERS)},
    }.items():
        assert addresses[name] == address, name
    for row, names in (("state", State), ("loss", LossCause), ("command", _gripper._Command)):
        meaning = next(line for line in page.splitlines() if f"| {row} |" in line)
        assert set(map(int, re.findall(r"[|:,] (\d+) [a-z]", meaning))) >= set(names), row
    refusals = page.split("| refusal | meaning |")[1].split("| detail")[0]
    assert set(map(int, re.findall(r"^\| (\d+) \|", refusals, re.MULTILINE))) == set(REFUSALS)


def test_a_tare_takes_new_zeros_and_is_refused_under_pressure(gripper):
    gripper.tare(LONG)
    assert gripper.counters()["tares"] == 1
    gripper.close()
    gripper.wait_holding(LONG)
    with pytest.raises(Refused) as refused:
        gripper.tare(LONG)
    assert refused.value.reason == 8


def test_a_sweep_learns_the_mounted_fingers(serve):
    virtual = serve("--tcp", "127.0.0.1:0", "--object", "none", "--finger-seed", "3", "--speed", "4")
    with Gripper(f"tcp://{virtual.port}", timeout_s=5) as gripper:
        before = gripper.settings["finger.free_bend_gain[0]"]
        gripper.tare(LONG)
        gripper.sweep(LONG)
        assert gripper.settings["finger.free_bend_gain[0]"] != before


def test_a_sweep_with_something_in_the_grip_says_so(serve):
    virtual = serve("--tcp", "127.0.0.1:0", "--speed", "4")
    with Gripper(f"tcp://{virtual.port}", timeout_s=5) as gripper:
        with pytest.raises(Refused) as refused:
            gripper.sweep(LONG)
        assert refused.value.reason == 11


def test_a_recording_is_written_as_csv(gripper, tmp_path):
    gripper.close()
    recording = list(gripper.record(0.5, 0.02))
    assert 5 < len(recording) <= 26
    assert recording[0].pressure_kpa < recording[-1].pressure_kpa
    softgrip.write_csv(tmp_path / "recording.csv", recording)
    with open(tmp_path / "recording.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(recording)
    assert float(rows[-1]["pressure_kpa"]) == recording[-1].pressure_kpa
    assert float(rows[-1]["residual_ue3"]) == recording[-1].residual_ue[2]


def test_a_port_that_is_not_there_is_named():
    with pytest.raises(softgrip.NoAnswer, match="/nowhere"):
        Gripper("/nowhere/gripper")
    with pytest.raises(ValueError, match="tcp://HOST:PORT"):
        Gripper("tcp://localhost")


def test_who_does_not_answer_is_said(serve, tmp_path):
    virtual = serve("--tty", str(tmp_path / "gripper"))
    with Gripper(virtual.port, device_id=10, timeout_s=0.1) as gripper:
        with pytest.raises(softgrip.NoAnswer):
            gripper.status()


def test_a_program_that_falls_silent_while_something_is_held_is_a_fault(serve, tmp_path):
    virtual = serve("--tty", str(tmp_path / "gripper"))
    with Gripper(virtual.port, timeout_s=5) as gripper:
        gripper.settings["grip.host_timeout_ms"] = 300
        gripper.close()
        gripper.wait_holding(LONG)
        virtual.wait_for("HostSilent")
        assert gripper.status().state == State.FAULT
        gripper.acknowledge()
        gripper.open(LONG)
        assert gripper.status().state == State.IDLE
