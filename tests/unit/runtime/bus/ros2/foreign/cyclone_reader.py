"""A reader of another vendor, Cyclone DDS, without ROS 2: counts decisions until their writer is gone.

Arguments: domain, most seconds.
"""

import json
import sys
import time
from dataclasses import dataclass

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import int32, uint32, uint64
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration


@dataclass
class Time_(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Decision_(IdlStruct, typename="aeros_msgs::msg::dds_::Decision_"):
    stamp: Time_
    record: uint64
    module: str
    skill: str
    verdict: str
    action: str
    reasons: str


participant = DomainParticipant(int(sys.argv[1]))
topic = Topic(participant, "rt/aeros/decisions", Decision_)
quality = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepAll)
reader = DataReader(participant, topic, qos=quality)
print("ready", flush=True)
end = time.monotonic() + float(sys.argv[2])
count, last = 0, None
while time.monotonic() < end:
    for one in reader.take(100):
        if isinstance(one, Decision_):
            count, last = count + 1, one
        else:  # it says that the writer is gone
            end = min(end, time.monotonic() + 2.0)
    time.sleep(0.02)
print(json.dumps({"count": count, "verdict": last.verdict if last else None}))
