"""minimalmodbus alone: functions 03, 04, 06 and 16."""

import minimalmodbus
from compatible import ACT, ATR, GTO, REQUEST, STATUS, Shown
from virtual import until


def test_it_loses_what_it_carries_and_knows(patient, story):
    gripper = minimalmodbus.Instrument(story.port, 9)
    gripper.serial.baudrate = 115_200
    # 0.05 s are its default, and too few where other things run on this machine.
    gripper.serial.timeout = 0.5

    def shown() -> Shown:
        return Shown.of(gripper.read_registers(STATUS, 3, functioncode=4))

    for function in (3, 4):
        for count in range(1, 7):
            assert len(gripper.read_registers(STATUS, count, functioncode=function)) == count

    gripper.write_register(REQUEST, 0, functioncode=6)
    gripper.write_register(REQUEST, ACT, functioncode=6)
    assert shown().sta == 1
    until("it is activated", lambda: shown().sta == 3)
    gripper.write_register(REQUEST + 2, 0xFFFF, functioncode=6)
    gripper.write_register(REQUEST + 1, 255, functioncode=6)
    assert (shown().pr, shown().gto) == (255, False)
    gripper.write_register(REQUEST, ACT | GTO, functioncode=6)
    assert (shown().obj, shown().gto) == (0, True)
    until("it holds", lambda: shown().obj == 2)

    until("the object is lost", lambda: shown().obj == 3)
    until("the log says so", lambda: story.said("LOST"))
    assert shown().pr == 255

    gripper.write_registers(REQUEST, [ACT | GTO, 0, 0xFFFF])
    until("it is open", lambda: shown().obj == 3 and shown().po <= 5)
    # It is acknowledged, or this would be refused.
    gripper.write_register(REQUEST + 1, 255)
    until("it closes on nothing", lambda: shown().obj == 3 and shown().po > 50)
    gripper.write_register(REQUEST, ACT | ATR, functioncode=16)
    assert shown().flt == 0xB
    until("the automatic release has ended", lambda: shown().flt == 0xF)
    gripper.write_register(REQUEST, 0, functioncode=16)
    assert shown().flt == 0
    gripper.serial.close()
