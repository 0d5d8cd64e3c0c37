"""Writes ground_face.x3p, a generated topography that resembles a measured ground steel face (see README.md).

The script needs only the standard library. The file is the same on every machine, except for the compression of the zip archive:

    python3 data/make_surface.py data/ground_face.x3p
"""

import hashlib
import math
import random
import struct
import sys
import zipfile

NX, NY = 256, 192  # number of points; x is across the grinding direction, y along it
DX, DY = 16e-6, 12e-6  # m
STEP = 2e-9  # m, one step of the 16-bit heights, which span ±65 µm
OFFSET = 12e-6  # m, height of step 0
SEED = 20190627


def profile(rng, length, count, shortest, longest):
    """Returns a sum of waves with random phases and amplitudes that increase with the wavelength: rough at all scales, not periodic."""
    waves = []
    for k in range(count):
        wavelength = shortest * (longest / shortest) ** (k / (count - 1)) * rng.uniform(0.93, 1.07)
        waves.append((2 * math.pi / wavelength, rng.uniform(0, 2 * math.pi), wavelength**0.7))
    values = [sum(a * math.sin(q * s + p) for q, p, a in waves) for s in length]
    mean = sum(values) / len(values)
    rms = math.sqrt(sum((v - mean) ** 2 for v in values) / len(values))
    return [(v - mean) / rms for v in values]


def main(path):
    rng = random.Random(SEED)
    xs = [(i + 0.5 - NX / 2) * DX for i in range(NX)]
    ys = [(j + 0.5 - NY / 2) * DY for j in range(NY)]

    # Grinding marks: long scratches along y with small lateral deviations, deeper than high.
    marks = profile(rng, [k * DX / 4 for k in range(4 * NX + 400)], 90, 35e-6, 700e-6)
    marks = [v - 0.28 * (v * v - 1) for v in marks]
    wander = profile(rng, ys, 14, 400e-6, 3e-3)
    along = profile(rng, ys, 40, 60e-6, 1.5e-3)
    heights = {}
    for j in range(NY):
        for i in range(NX):
            at = 4 * i + 200 + 6 * wander[j]
            k = int(at)
            mark = marks[k] + (at - k) * (marks[k + 1] - marks[k])
            noise = rng.gauss(0, 1)
            rough = 0.62e-6 * mark + 0.11e-6 * along[j] + 0.05e-6 * noise
            tilt = 1.1e-3 * xs[i] - 0.6e-3 * ys[j]
            form = -0.45 * xs[i] ** 2 + 0.2 * ys[j] ** 2  # m per m²: convex by 1.9 µm across the map
            heights[i, j] = 12e-6 + rough + tilt + form

    # Points without a measurement: small clusters on steep flanks that reflect light away from the objective, and a speck of dust.
    missing = set()
    for _ in range(45):
        i, j = rng.randrange(NX), rng.randrange(NY)
        for _ in range(rng.randrange(1, 9)):
            missing.add((i, j))
            i = min(max(i + rng.choice((-1, 0, 1)), 0), NX - 1)
            j = min(max(j + rng.choice((-1, 0, 1)), 0), NY - 1)
    missing |= {(i, j) for i in range(NX) for j in range(NY) if (i - 190.3) ** 2 + ((j - 51.6) * DY / DX) ** 2 < 20}

    points, valid = bytearray(), bytearray((NX * NY + 7) // 8)
    for j in range(NY):  # line by line, x fastest
        for i in range(NX):
            k = j * NX + i
            hole = (i, j) in missing
            points += struct.pack("<h", 0 if hole else round((heights[i, j] - OFFSET) / STEP))
            if not hole:
                valid[k // 8] |= 1 << (k % 8)

    def md5(data):
        return hashlib.md5(data).hexdigest().upper()

    main_xml = f"""<?xml version="1.0" encoding="UTF-8"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2">
  <Record1>
    <Revision>ISO5436 - 2000</Revision>
    <FeatureType>SUR</FeatureType>
    <Axes>
      <CX><AxisType>I</AxisType><DataType>D</DataType><Increment>{DX!r}</Increment><Offset>0.0</Offset></CX>
      <CY><AxisType>I</AxisType><DataType>D</DataType><Increment>{DY!r}</Increment><Offset>0.0</Offset></CY>
      <CZ><AxisType>A</AxisType><DataType>I</DataType><Increment>{STEP!r}</Increment><Offset>{OFFSET!r}</Offset></CZ>
    </Axes>
  </Record1>
  <Record2>
    <Date>2019-06-27T00:00:00</Date>
    <Instrument>
      <Manufacturer>none</Manufacturer><Model>data/make_surface.py</Model><Serial>none</Serial><Version>1</Version>
    </Instrument>
    <CalibrationDate>2019-06-27T00:00:00</CalibrationDate>
    <ProbingSystem><Type>Software</Type><Identification>seed {SEED}</Identification></ProbingSystem>
    <Comment>Made up, not measured: a ground face with tilt, form and missing points.</Comment>
  </Record2>
  <Record3>
    <MatrixDimension><SizeX>{NX}</SizeX><SizeY>{NY}</SizeY><SizeZ>1</SizeZ></MatrixDimension>
    <DataLink>
      <PointDataLink>bindata/data.bin</PointDataLink>
      <MD5ChecksumPointData>{md5(points)}</MD5ChecksumPointData>
      <ValidPointsLink>bindata/valid.bin</ValidPointsLink>
      <MD5ChecksumValidPoints>{md5(valid)}</MD5ChecksumValidPoints>
    </DataLink>
  </Record3>
  <Record4><ChecksumFile>md5checksum.hex</ChecksumFile></Record4>
</p:ISO5436_2>
""".encode()
    members = [
        ("main.xml", main_xml),
        ("bindata/data.bin", bytes(points)),
        ("bindata/valid.bin", bytes(valid)),
        ("md5checksum.hex", f"{md5(main_xml)} *main.xml\n".encode()),
    ]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name, data in members:
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED, 9)
    print(f"{path}: {NX} x {NY} points, {len(missing)} without measurement")


if __name__ == "__main__":
    main(sys.argv[1])
