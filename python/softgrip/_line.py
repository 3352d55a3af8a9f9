"""Registers over Modbus RTU, by pymodbus."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from pymodbus import FramerType
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ModbusException
from pymodbus.pdu import ModbusPDU

from ._errors import NoAnswer, RequestRejected


class Line:
    """One gripper on a serial line, or behind RTU over TCP."""

    def __init__(self, port: str, device_id: int, baudrate: int, timeout_s: float) -> None:
        self.port = port
        self._id = device_id
        self._client: ModbusSerialClient | ModbusTcpClient
        if port.startswith("tcp://"):
            host, colon, number = port.removeprefix("tcp://").rpartition(":")
            if not colon or not number.isdecimal():
                raise ValueError(f"{port}: must be tcp://HOST:PORT")
            self._client = ModbusTcpClient(
                host, port=int(number), framer=FramerType.RTU, timeout=timeout_s
            )
        else:
            self._client = ModbusSerialClient(port, baudrate=baudrate, timeout=timeout_s)
        if not self._client.connect():
            raise NoAnswer(f"{port}: cannot be opened")

    def close(self) -> None:
        """Closes it."""
        self._client.close()  # type: ignore[no-untyped-call]  # pymodbus leaves it untyped

    def read(self, address: int, count: int) -> list[int]:
        """Reads registers."""
        return self._ask(
            f"reading {address:#06x}",
            lambda: self._client.read_holding_registers(
                address, count=count, device_id=self._id
            ),
        )

    def write(self, address: int, words: Sequence[int]) -> None:
        """Writes registers, all or none."""
        self._ask(
            f"writing {address:#06x}",
            lambda: self._client.write_registers(address, list(words), device_id=self._id),
        )

    def write_and_read(
        self, address: int, words: Sequence[int], read_address: int, count: int
    ) -> list[int]:
        """Writes registers, and then reads others, in one request."""
        return self._ask(
            f"writing {address:#06x}",
            lambda: self._client.readwrite_registers(
                read_address=read_address,
                read_count=count,
                write_address=address,
                values=list(words),
                device_id=self._id,
            ),
        )

    def _ask(self, what: str, request: Callable[[], ModbusPDU]) -> list[int]:
        try:
            answer = request()
        except (ModbusException, OSError) as error:
            raise NoAnswer(f"{self.port}: {what}: {error}") from error
        if answer.isError():
            raise RequestRejected(f"{self.port}: {what}", answer.exception_code)
        return list(answer.registers)
