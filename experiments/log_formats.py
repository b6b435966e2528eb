"""The same synthetic run in every format, each written by the format's own library where it has one.

A writer takes a folder and a run (its columns have the units of `UNITS`), and gives the file and how a study names the
channels in it: channel -> ColumnSpec. Where a format has topics, position, attitude, velocity and actuators are topics
of their own.
"""

from __future__ import annotations

import datetime
import functools
import operator
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from seatruth.trials import ColumnSpec

UNITS = {"t": "s", "delta": "deg", "n": "rev/s", "x": "m", "y": "m", "psi": "deg", "u": "m/s", "v": "m/s", "r": "deg/s"}
UNITS |= {"phi": "deg", "p": "deg/s", "q": "deg/s"}  # of longer tables
INPUTS = ("delta", "n")
START_NS = 1_753_963_200 * 10**9
"""2025-07-31 12:00 UTC."""
KNOT = 1852 / 3600


class Written(NamedTuple):
    """A file and how a study names what is in it."""

    path: Path
    channels: dict[str, ColumnSpec]

    @property
    def reading(self) -> dict[str, Any]:
        """Arguments of `read_trial`."""
        return {
            "inputs": {c: spec for c, spec in self.channels.items() if c in INPUTS},
            "outputs": {c: spec for c, spec in self.channels.items() if c not in INPUTS},
        }


Writer = Callable[[Path, pd.DataFrame], Written]


def plain(run: pd.DataFrame) -> dict[str, ColumnSpec]:
    return {name: ColumnSpec(name, UNITS[name]) for name in run.columns if name != "t"}


def csv(folder: Path, run: pd.DataFrame) -> Written:
    run.to_csv(folder / "run.csv", index=False)
    return Written(folder / "run.csv", plain(run))


def parquet(folder: Path, run: pd.DataFrame) -> Written:
    run.to_parquet(folder / "run.parquet", index=False)
    return Written(folder / "run.parquet", plain(run))


def matlab(folder: Path, run: pd.DataFrame) -> Written:
    import scipy.io

    scipy.io.savemat(folder / "run.mat", {"run": {name: run[name].to_numpy() for name in run.columns}})
    return Written(folder / "run.mat", plain(run))


def hdf5(folder: Path, run: pd.DataFrame) -> Written:
    """As MATLAB lays out a struct of column vectors with -v7.3: a header of 512 bytes, then HDF5, vectors as rows."""
    import h5py

    path = folder / "run.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        group = file.create_group("run")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name in run.columns:
            group.create_dataset(name, data=run[name].to_numpy()[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
    with open(path, "r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64, HDF5 schema 1.00 .".ljust(124) + b"\x00\x02IM")
    return Written(path, plain(run))


def excel(folder: Path, run: pd.DataFrame) -> Written:
    run.to_excel(folder / "run.xlsx", index=False, sheet_name="trial")
    return Written(folder / "run.xlsx", plain(run))


def _samples(run: pd.DataFrame) -> list[SimpleNamespace]:
    """Each sample's values by name."""
    values = run.to_numpy(dtype=float).tolist()
    return [SimpleNamespace(**dict(zip(run.columns, sample))) for sample in values]


def _stamps(run: pd.DataFrame) -> list[int]:
    return [START_NS + round(t * 1e9) for t in run["t"]]


def _ros_topics(store: Any, run: pd.DataFrame) -> list[tuple[str, str, Callable[[int], Any]]]:
    """(topic, type, message of a sample)."""
    types = store.types
    vector, quaternion = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Quaternion"]

    def header(k: int) -> Any:
        stamp = types["builtin_interfaces/msg/Time"](*divmod(_stamps(run)[k], 10**9))
        kind = types["std_msgs/msg/Header"]
        return kind(0, stamp, "base") if "seq" in kind.__dataclass_fields__ else kind(stamp, "base")

    def twist(k: int) -> Any:
        value = types["geometry_msgs/msg/Twist"](
            vector(run["u"][k], -run["v"][k], 0.0), vector(0.0, 0.0, -np.radians(run["r"][k]))
        )
        return types["geometry_msgs/msg/TwistStamped"](header(k), value)

    def pose(k: int) -> Any:
        value = types["geometry_msgs/msg/Pose"](
            types["geometry_msgs/msg/Point"](run["x"][k], -run["y"][k], 0.0), quaternion(0.0, 0.0, 0.0, 1.0)
        )
        return types["geometry_msgs/msg/PoseStamped"](header(k), value)

    def number(name: str) -> tuple[str, str, Callable[[int], Any]]:
        return f"/{name}", "std_msgs/msg/Float64", lambda k: types["std_msgs/msg/Float64"](float(run[name][k]))

    return [
        ("/twist", "geometry_msgs/msg/TwistStamped", twist),
        ("/pose", "geometry_msgs/msg/PoseStamped", pose),
        number("psi"),
        number("delta"),
        number("n"),
    ]


_ROS_CHANNELS = {
    "delta": ColumnSpec("/delta.data", "deg"),
    "n": ColumnSpec("/n.data", "rev/s"),
    "x": ColumnSpec("/pose.pose.position.x", "m"),
    "y": ColumnSpec("/pose.pose.position.y", "m", sign=-1),
    "psi": ColumnSpec("/psi.data", "deg"),
    "u": ColumnSpec("/twist.twist.linear.x", "m/s"),
    "v": ColumnSpec("/twist.twist.linear.y", "m/s", sign=-1),
    "r": ColumnSpec("/twist.twist.angular.z", "rad/s", sign=-1),
}


def _write_bag(writer: Any, store: Any, serialize: Callable[[Any, str], Any], run: pd.DataFrame) -> None:
    topics = _ros_topics(store, run)
    stamps = _stamps(run)
    with writer:
        connections = [writer.add_connection(topic, kind, typestore=store) for topic, kind, _ in topics]
        for k, stamp in enumerate(stamps):
            for connection, (_, kind, message) in zip(connections, topics):
                writer.write(connection, stamp, serialize(message(k), kind))


def ros1(folder: Path, run: pd.DataFrame) -> Written:
    from rosbags.rosbag1 import Writer as BagWriter
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    _write_bag(BagWriter(folder / "run.bag"), store, store.serialize_ros1, run)
    return Written(folder / "run.bag", _ROS_CHANNELS)


def ros2(folder: Path, run: pd.DataFrame) -> Written:
    from rosbags.rosbag2 import Writer as BagWriter
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    _write_bag(BagWriter(folder / "run", version=9), store, store.serialize_cdr, run)
    return Written(folder / "run", _ROS_CHANNELS)


def mcap(folder: Path, run: pd.DataFrame) -> Written:
    from mcap.writer import Writer as McapWriter
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with open(folder / "run.mcap", "wb") as stream:
        writer: Any = McapWriter(stream)
        writer.start()
        topics = _ros_topics(store, run)
        channels = []
        for topic, kind, _ in topics:
            text, _ = store.generate_msgdef(kind, ros_version=2)
            schema = writer.register_schema(kind, "ros2msg", text.encode())
            channels.append(writer.register_channel(topic, "cdr", schema))
        for k, stamp in enumerate(_stamps(run)):
            for channel, (_, kind, message) in zip(channels, topics):
                writer.add_message(channel, stamp, bytes(store.serialize_cdr(message(k), kind)), stamp)
        writer.finish()
    return Written(folder / "run.mcap", _ROS_CHANNELS)


def ulog_file(path: Path, topics: dict[str, tuple[np.ndarray, dict[str, np.ndarray]]]) -> None:
    """Topics: times (n,) us, and fields (n,); fields called "name[k]" are an array."""
    import pyulog

    log = pyulog.ULog(None)
    for number, (name, (stamps, fields)) in enumerate(topics.items()):
        values = {"timestamp": stamps.astype(np.uint64), **fields}
        kind = np.dtype([(field, column.dtype) for field, column in values.items()])
        table = np.empty(stamps.size, dtype=kind)
        for field, column in values.items():
            table[field] = column
        kinds = {field: _ULOG_KINDS[column.dtype.str] for field, column in values.items()}
        log._data_list.append(
            pyulog.ULog.Data(
                SimpleNamespace(
                    multi_id=0,
                    msg_id=number,
                    message_name=name,
                    field_data=[SimpleNamespace(field_name=field, type_str=kind) for field, kind in kinds.items()],
                    timestamp_idx=0,
                    buffer=table.tobytes(),
                    dtype=kind,
                )
            )
        )
        arrays = Counter(field.partition("[")[0] for field in fields)
        declared = [("uint64_t", 0, "timestamp")]
        for field, size in arrays.items():
            declared.append((kinds.get(field) or kinds[f"{field}[0]"], 0 if field in kinds else size, field))
        log._message_formats[name] = SimpleNamespace(name=name, fields=declared)
    log.write_ulog(str(path))


_ULOG_KINDS = {"<u8": "uint64_t", "<f8": "double", "<i4": "int32_t"}


def ulog(folder: Path, run: pd.DataFrame) -> Written:
    """Fields in double, which PX4 uses for few: so the numbers come back to rounding."""
    stamps = np.round(run["t"].to_numpy() * 1e6).astype(np.uint64) + np.uint64(5_000_000)
    values = {name: run[name].to_numpy(dtype=np.float64) for name in run.columns}
    topics = {
        "vehicle_local_position": {name: values[name] for name in ("x", "y", "u", "v")},
        "vehicle_attitude": {name: values[name] for name in ("psi", "r")},
        "actuator_outputs": {"output[0]": values["delta"], "output[1]": values["n"]},
    }
    ulog_file(folder / "run.ulg", {name: (stamps, fields) for name, fields in topics.items()})
    channels = {
        "delta": ColumnSpec("actuator_outputs.output[0]", "deg"),
        "n": ColumnSpec("actuator_outputs.output[1]", "rev/s"),
        **{c: ColumnSpec(f"vehicle_local_position.{c}", UNITS[c]) for c in ("x", "y", "u", "v")},
        **{c: ColumnSpec(f"vehicle_attitude.{c}", UNITS[c]) for c in ("psi", "r")},
    }
    return Written(folder / "run.ulg", channels)


def dataflash(folder: Path, run: pd.DataFrame) -> Written:
    """Fields in double, with units as ArduPilot states them."""
    from pymavlink.DFReader import DFFormat, DFReader_binary

    log: Any = DFReader_binary.__new__(DFReader_binary)
    log.formats = {0x80: DFFormat(0x80, "FMT", 89, "BBnNZ", "Type,Length,Name,Format,Columns")}
    kinds = {
        "UNIT": ("QbZ", "TimeUS,Id,Label", ""),
        "FMTU": ("QBNN", "TimeUS,FmtType,UnitIds,MultIds", ""),
        "POS": ("Qdddd", "TimeUS,X,Y,U,V", "smmnn"),
        "ATT": ("Qdd", "TimeUS,Yaw,R", "sdk"),
        "ACT": ("Qdd", "TimeUS,Rud,N", "sd-"),
    }
    formats = {}
    for name, (codes, fields, _) in kinds.items():
        formats[name] = DFFormat(0, name, 0, codes, fields)
        log.add_format(formats[name])
    data = [log.make_format_msgbuf(log.formats[0x80])]
    data += [log.make_format_msgbuf(described) for described in formats.values()]
    for mark, label in {"s": "s", "d": "deg", "k": "deg/s", "m": "m", "n": "m/s", "-": ""}.items():
        data.append(log.make_msgbuf(formats["UNIT"], (0, ord(mark), label.encode())))
    for name, (_, _, units) in kinds.items():
        if units:
            ids = (0, formats[name].type, units.encode(), ("F" + "-" * (len(units) - 1)).encode())
            data.append(log.make_msgbuf(formats["FMTU"], ids))
    for row in _samples(run):
        time = round(row.t * 1e6) + 7_000_000
        data.append(log.make_msgbuf(formats["ACT"], (time, row.delta, row.n)))
        data.append(log.make_msgbuf(formats["ATT"], (time, row.psi, row.r)))
        data.append(log.make_msgbuf(formats["POS"], (time, row.x, row.y, row.u, row.v)))
    (folder / "run.bin").write_bytes(b"".join(data))
    channels = {
        "delta": ColumnSpec("ACT.Rud"),
        "n": ColumnSpec("ACT.N", "rev/s"),
        "psi": ColumnSpec("ATT.Yaw"),
        "r": ColumnSpec("ATT.R"),
        **{c: ColumnSpec(f"POS.{c.upper()}") for c in ("x", "y", "u", "v")},
    }
    return Written(folder / "run.bin", channels)


def sentence(text: str) -> str:
    """A sentence with its check sum, from the text between "$" and "*"."""
    return f"${text}*{functools.reduce(operator.xor, text.encode()):02X}"


def nmea(folder: Path, run: pd.DataFrame) -> Written:
    """Stamped sentences. NMEA has no local positions, and more digits than instruments give bring the run back."""
    lines: list[str] = []
    for row in _samples(run):
        stamp = datetime.datetime.fromtimestamp(START_NS / 1e9 + row.t, datetime.UTC).isoformat()
        texts = (
            f"AGRSA,{row.delta:.9f},A,,V",
            f"IIRPM,S,0,{60 * row.n:.9f},,A",
            f"HEHDT,{row.psi:.9f},T",
            f"TIROT,{60 * row.r:.9f},A",
            f"VDVBW,,,V,{row.u / KNOT:.9f},{row.v / KNOT:.9f},A",
        )
        lines += [f"{stamp} {sentence(text)}\r\n" for text in texts]
    (folder / "run.nmea").write_text("".join(lines), newline="")
    channels = {
        "delta": ColumnSpec("AGRSA.rudder"),
        "n": ColumnSpec("IIRPM[S0].shaft_speed"),
        "psi": ColumnSpec("HEHDT.heading"),
        "u": ColumnSpec("VDVBW.longitudinal_ground_speed"),
        "v": ColumnSpec("VDVBW.transverse_ground_speed"),
        "r": ColumnSpec("TIROT.rate_of_turn"),
    }
    return Written(folder / "run.nmea", channels)


WRITERS: dict[str, Writer] = {
    writer.__name__: writer for writer in (csv, parquet, matlab, hdf5, excel, ros1, ros2, mcap, ulog, dataflash, nmea)
}


def manoeuvre(samples: Sequence[float] | np.ndarray) -> pd.DataFrame:
    """A made-up motion at these times, s: smooth, and every channel different."""
    t = np.asarray(samples, dtype=float)
    return pd.DataFrame(
        {
            "t": t,
            "delta": 10 * np.sign(np.sin(0.3 * t)),
            "n": 12.35 + 0 * t,
            "x": 1.2 * t,
            "y": 3 * np.sin(0.2 * t),
            "psi": 30 + 15 * np.sin(0.25 * t),
            "u": 1.2 - 0.1 * np.sin(0.1 * t) ** 2,
            "v": 0.05 * np.cos(0.25 * t),
            "r": 3.75 * np.cos(0.25 * t),
        }
    )
