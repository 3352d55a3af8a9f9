"""robotiq2f 0.2.0, on minimalmodbus: function 04 to read, 16 with one register to activate and three to move."""

import robotiq2f.robotiq2f as driver
from virtual import until


def test_it_loses_what_it_carries_and_knows(patient, story, monkeypatch):
    # It looks for an adapter by its serial number.
    monkeypatch.setattr(driver.LinuxFindTTYWithSerialNumber, "find", lambda *_: story.port)
    gripper = driver.Robotiq2F85("any", async_control=False)
    # 0.05 s are its default, and too few where other things run on this machine.
    gripper.client.serial.timeout = 0.5

    gripper.reset()
    assert gripper.is_activated and not gripper.in_fault
    gripper.go_to(opening=0, speed=150, force=235)
    # It keeps a status for 5 ms, so that it may have seen nothing move yet.
    until("it holds", lambda: gripper.object_detected)
    status = gripper.read_status()
    assert status.goal_opening == 0 and 0 < status.opening < 85 and not status.moving

    until("the object is lost", lambda: not gripper.object_detected)
    until("the log says so", lambda: story.said("LOST"))
    assert not gripper.in_fault

    gripper.go_to(opening=85, speed=150, force=235)
    until("it is open", lambda: gripper.opening > 80)
    assert story.said("acknowledged", after="LOST")
    gripper.reset()
    assert gripper.is_activated and not gripper.in_fault
    gripper.close()
