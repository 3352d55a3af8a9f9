"""Recordings, read by what other people have written for that."""

import subprocess

import pandas
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from virtual import LONG, binary

#: A grasp and a loss.
LOSS = """
[[step]]
at_s = 0.3
input = "grip"

[[step]]
when = { event = "holding" }
after_s = 0.3
object = "pull out"

[[step]]
when = { event = "lost" }
after_s = 0.2
end = true
"""


@pytest.fixture
def record(tmp_path):
    """Records a grasp and a loss of the virtual gripper, and gives the file."""

    def run(name: str):
        script = tmp_path / "loss.toml"
        script.write_text(LOSS)
        file = tmp_path / name
        command = [binary(), "record", "--from", "virtual", "--script", script, "--speed", "4"]
        subprocess.run([*command, "--out", file], check=True, timeout=LONG, capture_output=True)
        return file

    return run


def test_an_mcap_file_is_read_with_nothing_but_itself(record):
    with open(record("loss.mcap"), "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        messages = {channel.topic: [] for channel in summary.channels.values()}
        for _, channel, message, decoded in reader.iter_decoded_messages():
            assert message.log_time == message.publish_time
            messages[channel.topic].append((message.log_time, decoded))
    assert set(messages) == {"/snapshot", "/event", "/settings", "/provenance", "/frames"}
    assert summary.statistics.message_count == sum(map(len, messages.values()))

    snapshots = messages["/snapshot"]
    times = [snapshot.t_s for _, snapshot in snapshots]
    assert times == pytest.approx([0.001 + 0.02 * n for n in range(len(times))])
    # The gripper's clock on that of the calendar.
    (first_ns, first), (last_ns, last) = snapshots[0], snapshots[-1]
    assert (last_ns - first_ns) * 1e-9 == pytest.approx(last.t_s - first.t_s, abs=1e-6)
    assert first_ns > 1.7e18
    states = first.DESCRIPTOR.fields_by_name["state"].enum_type.values_by_number
    seen = [states[snapshot.state].name for _, snapshot in snapshots]
    assert seen[0] == "idle" and "closing" in seen and "holding" in seen
    held = max(snapshot.pressure_kpa for _, snapshot in snapshots)
    assert 135 < held < 145

    events = [(event.name, event.t_s) for _, event in messages["/event"]]
    assert [name for name, _ in events].count("contact") == 3
    assert events[-1][0] == "lost"
    provenance = messages["/provenance"][0][1]
    assert (provenance.source, len(provenance.table)) == ("virtual", 16)
    settings = {setting.name: setting.value for setting in messages["/settings"][0][1].settings}
    assert settings["grip.grip_pressure_kpa"] == 140

    # Every tick: each column is differences, from message to message anew.
    frames = [frames for _, frames in messages["/frames"]]
    ticks = sum(len(frame.gauge1) for frame in frames)
    assert ticks == pytest.approx(1000 * last.t_s, abs=20)
    codes = [code for frame in frames for code in pandas.Series(frame.monitor).cumsum()]
    assert len(codes) == ticks and min(codes) >= 0
    # 3 V of 3.3 V are 200 kPa.
    assert max(codes) / 65536 * 3.3 / 3.0 * 200 == pytest.approx(held, abs=2)


def test_a_csv_file_is_a_table_for_pandas(record):
    table = pandas.read_csv(record("loss.csv"))
    assert list(table.columns[:6]) == [
        "t_s",
        "strain1_ue",
        "strain2_ue",
        "strain3_ue",
        "pressure_kpa",
        "setpoint_kpa",
    ]
    assert table.t_s.diff().dropna().to_numpy() == pytest.approx(0.001)
    held = table[table.state == "holding"]
    assert len(held) > 100 and held.pressure_kpa.between(130, 150).all()
    assert set(table.holding.unique()) == {0, 1}
    lost = table[table.events == "lost"]
    assert len(lost) == 1 and lost.loss_latency_ms.iloc[0] < 200
    assert table[table.t_s < lost.t_s.iloc[0]].loss_latency_ms.isna().all()
