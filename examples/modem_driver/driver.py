"""A modem's driver, for a scenario that says `link.carried_by: drivers`: it carries frames between platforms by UDP.

It speaks two topics: what its platform's modem publishes as `tx` goes out, a datagram a packet, to the drivers of all
other platforms; what comes from those it publishes as `rx`. A driver of a real modem puts that in the place of `Water`,
and keeps the rest: what a frame says it need not know.
"""

from __future__ import annotations

import argparse
import heapq
import queue
import random
import socket
import threading
import time
from collections.abc import Callable
from itertools import count

import msgpack
import zenoh

from comms.said.codec import Header, decode, encode
from comms.said.messages import Packet
from comms.said.wire import WireError
from comms.wall.clock import MissionTime

HERE = "127.0.0.1"
STEP_S = 0.02
LARGEST_DATAGRAM = 65_535


class Water:
    """Carries frames to the drivers at other ports, and from them. `lost`: the share of frames that do not come
    through. An empty datagram says that a driver is there: it is sent to from then on."""

    def __init__(self, port: int, others: list[int], lost: float) -> None:
        self._lost = lost
        self._others = {(HERE, other) for other in others}
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((HERE, port))
        self.port: int = self._socket.getsockname()[1]
        for other in self._others:
            self._socket.sendto(b"", other)

    def send(self, packet: Packet) -> None:
        """Sends a packet to all others, with for whom it is."""
        for other in list(self._others):
            self._socket.sendto(msgpack.packb((packet.to, packet.frames)), other)

    def listen(self, platform: str, hears: Callable[[Packet], None]) -> None:
        """Tells what has come through of each packet that is for this platform, once it is over; never returns."""
        while True:
            datagram, other = self._socket.recvfrom(LARGEST_DATAGRAM)
            if not datagram:
                self._others.add(other)
                continue
            try:
                to, frames = msgpack.unpackb(datagram)
                frames = [frame for frame in frames if random.random() >= self._lost]
                if frames and to in ("", platform):
                    hears(Packet(tuple(map(bytes, frames))))
            except (ValueError, TypeError):
                print("what is no packet has come, and is dropped", flush=True)


def serve(session: zenoh.Session, run: str, platform: str, water: Water, delay_ms: int) -> None:
    """Lets a platform's driver take part in a run until it is interrupted. `delay_ms`: mission time from when a packet
    is sent until others hear it, for its way and its length."""
    root = f"secondlook/v1/{run}"
    tx_key, rx_key, time_key = f"{root}/modem/{platform}/tx", f"{root}/modem/{platform}/rx", f"{root}/clock/time"
    inbox: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()
    come: queue.SimpleQueue[Packet] = queue.SimpleQueue()

    def enqueue(sample: zenoh.Sample) -> None:
        inbox.put((str(sample.key_expr), sample.payload.to_bytes()))

    subscribers = [session.declare_subscriber(key, enqueue) for key in (tx_key, time_key)]
    threading.Thread(target=water.listen, args=(platform, come.put), daemon=True).start()
    mission_time, under_way, sent = MissionTime(), list[tuple[int, int, Packet]](), count()
    incarnation, sequence = 0, 0
    while subscribers:
        try:
            key, payload = inbox.get(timeout=STEP_S)
        except queue.Empty:
            key, payload = "", b""
        now_s = time.monotonic()
        if key == time_key:
            _, told_ms, factor, *_ = msgpack.unpackb(payload)
            if told_ms is not None:
                first = not mission_time.known
                mission_time.hear(told_ms, factor, now_s)
                if first:
                    incarnation = mission_time.now_ms(now_s) // 1000  # larger each time it is started
                    print("the mission is under way", flush=True)
        if not mission_time.known:
            continue
        now_ms = mission_time.now_ms(now_s)
        if key == tx_key:
            try:
                header, packet = decode(payload, Packet)
            except WireError:
                continue
            assert isinstance(packet, Packet)
            heapq.heappush(under_way, (header.sent_ms + delay_ms, next(sent), packet))
        while not come.empty():
            header = Header(f"driver-{platform}", incarnation, sequence, now_ms)
            session.put(rx_key, encode(header, come.get()))
            sequence += 1
        while under_way and under_way[0][0] <= now_ms:
            water.send(heapq.heappop(under_way)[2])


def main() -> None:
    """Connects, and takes part until Ctrl-C."""
    parser = argparse.ArgumentParser(description="A modem's driver, which carries frames by UDP on this machine.")
    parser.add_argument("platform", help="a vehicle's id, or ship")
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447", help="the router, or a process of this platform")
    parser.add_argument(
        "--run", required=True, help="the run's name: the scenario's, if `secondlook node` got no other"
    )
    parser.add_argument("--port", type=int, default=0, help="of UDP, where others send to; 0: one that is free")
    parser.add_argument("--to", nargs="*", type=int, default=[], metavar="PORT", help="of the drivers that are there")
    parser.add_argument("--lost", type=float, default=0.0, metavar="SHARE", help="of the frames that come here")
    parser.add_argument("--delay", type=float, default=0.0, metavar="S", help="until others hear, of mission time")
    options = parser.parse_args()
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("connect/endpoints", f'["{options.connect}"]')
    config.insert_json5("connect/timeout_ms", "10000")
    water = Water(options.port, options.to, options.lost)
    try:
        with zenoh.open(config) as session:
            print(f"{options.platform} is on port {water.port}", flush=True)
            serve(session, options.run, options.platform, water, round(options.delay * 1000))
    except KeyboardInterrupt:
        print(f"{options.platform} ends")
    except zenoh.ZError:
        raise SystemExit(f"no connection to {options.connect} within 10 s") from None


if __name__ == "__main__":
    main()
