"""Writers of small files with measured topographies, from the descriptions of the formats, for test_import.py and judge_surface.py.

A writer takes heights[i, j] in um and the spacing in um. NaN marks unmeasured points; i is along x, and j counts from the upper line down.
"""

import io
import struct
import zipfile

import numpy as np

SPACING = (2.0, 0.75)


def heights(holes):
    """7 x 5 heights with one spike, different from all mirror images. All heights are multiples of 1/8 um, which each format can store."""
    x, y = np.meshgrid(np.arange(7.0), np.arange(5.0), indexing="ij")
    values = x / 2 + y * y / 8
    values[5, 1] = 4.75
    if holes:
        values[2, 3] = values[0, 0] = np.nan
    return values


def lines(values, kind, hole):
    """Lines of constant y; x varies fastest."""
    return np.where(np.isnan(values), hole, values).T.astype(kind).tobytes()


def nms(values, spacing):
    nx, ny = values.shape
    low, high = values.min(), values.max()
    counts = np.rint((values - low) / (high - low) * (2**16 - 2))
    head = bytearray(3468)
    struct.pack_into("<dd", head, 16, low, high)
    head[1076:1092] = b"2020-01-02 03:04"
    # Real files have nanometres here. SurfaceTopography reads them as millimetres.
    struct.pack_into("<IIdd", head, 1368, nx, ny, spacing[0] * 1e3, spacing[1] * 1e3)
    return bytes(head) + lines(counts, "<u2", 0)


def os3d(values, spacing):
    texts = b"".join(struct.pack("<i", len(text)) + text for text in (b"sample", b"2020-01-02 03:04:05"))
    shape = struct.pack("<iidddd", *values.shape, *spacing, 0.0, 0.0)
    return b"OmniSurf3D" + struct.pack("<ii", 1, 0) + texts + shape + lines(values, "<f4", -3.4028235e38) + b"\0"


def tmd(values, spacing):
    head = b"Binary TrueMap Data File v2.0\r\n\0" + b"Created by TrueMap v6\r\n\0"
    sides = [n * step * 1e-3 for n, step in zip(values.shape, spacing, strict=True)]
    return head + struct.pack("<IIffff", *values.shape, *sides, 0.0, 0.0) + lines(values * 1e-3, "<f4", np.nan)


def opd(values, spacing):
    # The unit of the heights is nm times Wavelength / Mult. Columns go from the left, and each column from below.
    columns = np.where(np.isnan(values), np.float32(1e38), values * 1000 / 600 * 1000)[:, ::-1].astype("<f4").tobytes()
    blocks = [
        (b"RAW_DATA", 3, struct.pack("<HHH", *values.shape, 4) + columns),
        (b"Wavelength", 7, struct.pack("<f", 600.0)),
        (b"Mult", 6, struct.pack("<h", 1000)),
        (b"Aspect", 7, struct.pack("<f", spacing[1] / spacing[0])),
        (b"Pixel_size", 7, struct.pack("<f", spacing[0] * 1e-3)),
    ]
    entries = [(b"Directory", 1, b"\0" * (24 * (len(blocks) + 1))), *blocks]
    return (
        b"\1\0"
        + b"".join(struct.pack("<16shlH", name, kind, len(data), 0) for name, kind, data in entries)
        + b"".join(data for *_, data in blocks)
    )


def plu(values, spacing):
    nx, ny = values.shape
    head = b"2020-01-02 03:04:05".ljust(128, b"\0") + struct.pack("<I", 0) + bytes(256)
    head += struct.pack("<3I7f", ny, nx, 1, 1.0, *spacing, 0.0, 0.0, 1.0, 0.0)
    head += struct.pack("<10IdfII", 3, 0, 0, 0, 0, nx, ny, nx, ny, 0, 0.0, 0.0, 0, 0)
    head += struct.pack("<8BI", 0, 1, 0, 0, 0, 0, 0, 0, 0) + struct.pack("<II", ny, nx)
    return head + lines(values, "<f4", 1000001.0) + struct.pack("<ff", 0.0, 1.0)


def plux(values, spacing):
    nx, ny = values.shape
    index = f"""<?xml version="1.0"?><xml><GENERAL><DATE>2020-01-02 03:04:05</DATE><IMAGE_SIZE_X>{nx}</IMAGE_SIZE_X>
<IMAGE_SIZE_Y>{ny}</IMAGE_SIZE_Y><FOV_X>{spacing[0]}</FOV_X><FOV_Y>{spacing[1]}</FOV_Y></GENERAL>
<INFO><ITEM_0><NAME>Device</NAME><VALUE>none</VALUE></ITEM_0></INFO>
<LAYER_0><FILENAME_Z>LAYER_0.raw</FILENAME_Z></LAYER_0></xml>"""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("index.xml", index)
        archive.writestr("LAYER_0.raw", lines(values, "<f4", np.nan))
    return out.getvalue()


def zmg(values, spacing):
    head = b"Zeta-Instruments".ljust(85, b"\0") + struct.pack("<II4xfff8xI", *values.shape, *spacing, 0.125, 0)
    return head.ljust(85 + 36 + 84, b"\0") + lines(values / 0.125, "<u2", 0)


def gwy(values, spacing, channels=(("Topography", "m"),)):
    """GWY file with channels (title, unit of the heights). All channels after the first have the heights in reverse order."""

    def text(name):
        return name.encode() + b"\0"

    def holder(name, *parts):
        body = b"".join(parts)
        return text(name) + struct.pack("<I", len(body)) + body

    def field(data, unit):
        nx, ny = data.shape
        sides = [n * step * 1e-6 for n, step in zip(data.shape, spacing, strict=True)]
        units = [
            text(f"si_unit_{axis}") + b"o" + holder("GwySIUnit", text("unitstr") + b"s" + text(of))
            for axis, of in (("xy", "m"), ("z", unit))
        ]
        numbers = [text(key) + b"i" + struct.pack("<i", n) for key, n in (("xres", nx), ("yres", ny))]
        lengths = [text(key) + b"d" + struct.pack("<d", side) for key, side in zip(("xreal", "yreal"), sides, strict=True)]
        return b"o" + holder(
            "GwyDataField", *numbers, *lengths, *units, text("data") + b"D" + struct.pack("<I", data.size) + lines(data, "<f8", 0.0)
        )

    parts = []
    for k, (title, unit) in enumerate(channels):
        data = values if k == 0 else values[::-1, ::-1]
        parts += [text(f"/{k}/data") + field(data * 1e-6, unit), text(f"/{k}/data/title") + b"s" + text(title)]
        if np.isnan(data).any():
            parts.append(text(f"/{k}/mask") + field(np.isnan(data).astype(float), ""))
    return b"GWYP" + holder("GwyContainer", *parts)


def mi(values, spacing, channels=(("Topography", "um"),)):
    """MI file with channels (name, unit of the values). The last line comes first."""
    head = {"fileType": "Image", "xPixels": values.shape[0], "yPixels": values.shape[1]}
    head |= {f"{axis}Length": repr(n * step * 1e-6) for axis, n, step in zip("xy", values.shape, spacing, strict=True)}
    entries = list(head.items())
    for name, unit in channels:
        entries += [("bufferLabel", name), ("bufferUnit", unit), ("bufferRange", 4096.0)]
    text = "".join(f"{key:<14}{value}\n" for key, value in [*entries, ("data", "BINARY")])
    return text.encode() + lines(values[:, ::-1] * 8, "<i2", 0) * len(channels)


def nanoscope(values, spacing, channels=(("Height", "nm"),)):
    """SPM file with channels (name, unit per V of the sensor). The last line comes first."""
    size = values.size * 2
    sides = " ".join(repr(n * step) for n, step in zip(values.shape, spacing, strict=True))
    text = ["\\*File list", "\\Version: 0x05120130", "\\*Scanner list"]
    text += [f"\\@Sens. {name}: V 31.25 {unit}/V" for name, unit in channels]
    for k, (name, _) in enumerate(channels):
        text += ["\\*Ciao image list", f"\\Data offset: {4096 + k * size}", f"\\Data length: {size}", "\\Bytes/pixel: 2"]
        text += [f"\\Samps/line: {values.shape[0]}", f"\\Number of lines: {values.shape[1]}", f"\\Scan size: {sides} ~m"]
        text += [f'\\@2:Image Data: S [{name}] "{name}"', f"\\@2:Z scale: V [Sens. {name}] (0.0078125 V/LSB) 512.0 V"]
    head = "\r\n".join([*text, "\\*File list end", "\x1a"]).encode().ljust(4096, b"\0")
    # 512 V / 65536 * 31.25 nm/V = 1/4096 um.
    return head + lines(values[:, ::-1] * 4096, "<i2", 0) * len(channels)


def ibw(values, spacing, unit="m", side="m"):
    """IBW file: wave of Igor with one layer. Columns go from below."""
    data = np.asfortranarray(values[:, ::-1] * 1e-6).tobytes("F")
    head = struct.pack("<hhiii", 5, 0, 320 + len(data), 0, 0).ljust(64, b"\0")
    head += struct.pack("<12xihh6xh32s8x", values.size, 4, 0, 1, b"wave") + struct.pack("<4i", *values.shape, 1, 0)
    head += struct.pack("<8d", *(step * 1e-6 for step in spacing), *6 * (1.0,)) + unit.encode().ljust(4, b"\0")
    head = bytearray((head + side.encode().ljust(4, b"\0") * 2).ljust(384, b"\0"))
    struct.pack_into("<h", head, 2, (-sum(struct.unpack("<192h", head)) + 2**15) % 2**16 - 2**15)
    return bytes(head) + data


def metropro(values, spacing):
    """MetroPro file. The pixels are square, since the format has one spacing."""
    head = bytearray(834)
    struct.pack_into(">4sHI", head, 0, b"\x88\x1b\x03\x6f", 1, 834)
    struct.pack_into(">HHI", head, 68, *values.shape, 4 * values.size)
    struct.pack_into(">f4x4x", head, 164, 0.5)
    struct.pack_into(">ffff", head, 168, 640e-9, 0.0, 1.0, 0.0)
    struct.pack_into(">f", head, 184, spacing[0] * 1e-6)
    struct.pack_into(">h", head, 218, 1)
    return bytes(head) + lines(np.rint(values * 1e-6 / (0.5 * 640e-9 / 32768)), ">i4", 2147483640)


def hgt(values):
    """HGT file: a square map without unit and size."""
    return lines(values, ">i2", -32768)


def datx(values, spacing):
    import h5py

    out = io.BytesIO()
    with h5py.File(out, "w") as file:
        text = h5py.string_dtype("ascii")
        rows = [("Root", "Measurement", "{1}"), ("{1}", "Surface", "{2}"), ("{2}", "Path", "/Data/Surface/{3}")]
        kind = np.dtype([("Category", text), ("Key", text), ("Value", text)])
        file["MetaData"] = np.array(rows, kind)
        data = file.create_dataset("/Data/Surface/{3}", data=np.where(np.isnan(values), 1e300, values * 1e3).T)
        data.attrs["No Data"] = np.array([1e300])
        data.attrs["Unit"] = np.array([b"NanoMeters"], object)
        kind = np.dtype([("Category", text), ("BaseUnit", text), ("Parameters", "f8", (4,))])
        for axis, unit, step in zip("XYZ", ("Pixels", "Pixels", "NanoMeters"), (*spacing, 1.0), strict=True):
            category = "HeightCat" if axis == "Z" else "LateralCat"
            data.attrs[f"{axis} Converter"] = np.array([(category, unit, (0.0, step * 1e-6, 0.0, 0.0))], kind)
    return out.getvalue()


#: Extension: (writer, true if the format marks unmeasured points).
WRITERS = {
    "nms": (nms, False),
    "os3d": (os3d, True),
    "tmd": (tmd, True),
    "opd": (opd, True),
    "plu": (plu, True),
    "plux": (plux, True),
    "zmg": (zmg, False),
    "gwy": (gwy, True),
    "mi": (mi, False),
    "spm": (nanoscope, False),
    "ibw": (ibw, True),
    "datx": (datx, True),
}
