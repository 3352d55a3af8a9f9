"""pymodbus alone: functions 03, 04, 06, 16 and 23."""

from compatible import ACT, ATR, GTO, REQUEST, STATUS, Shown
from pymodbus.client import ModbusSerialClient
from virtual import until


def test_it_loses_what_it_carries_and_knows(story):
    client = ModbusSerialClient(story.port, baudrate=115_200, timeout=2)
    assert client.connect()

    def good(answer):
        assert not answer.isError(), answer
        return answer

    def shown() -> Shown:
        answer = good(client.read_holding_registers(STATUS, count=3, device_id=9))
        return Shown.of(answer.registers)

    def write_read(words: list[int]) -> Shown:
        answer = client.readwrite_registers(
            read_address=STATUS, read_count=3, write_address=REQUEST, values=words, device_id=9
        )
        return Shown.of(good(answer).registers)

    assert good(client.read_input_registers(STATUS, count=6, device_id=9)).registers[3:] == [0, 0, 0]
    assert write_read([0, 0, 0]).flt == 0
    assert write_read([ACT, 0, 0]).sta == 1
    until("it is activated", lambda: shown().sta == 3)
    assert write_read([ACT | GTO, 255, 0xFFFF]).obj == 0
    until("it holds", lambda: shown().obj == 2)

    until("the object is lost", lambda: shown().obj == 3)
    until("the log says so", lambda: story.said("LOST"))
    assert shown().pr == 255

    good(client.write_register(REQUEST + 1, 0, device_id=9))
    until("it is open", lambda: shown().obj == 3 and shown().po <= 5)
    # It is acknowledged, or this would be refused.
    good(client.write_register(REQUEST + 1, 255, device_id=9))
    until("it closes on nothing", lambda: shown().obj == 3 and shown().po > 50)
    good(client.write_registers(REQUEST, [ACT | ATR, 0, 0], device_id=9))
    assert shown().flt == 0xB
    until("the automatic release has ended", lambda: shown().flt == 0xF)
    assert write_read([0, 0, 0]).flt == 0
    client.close()
