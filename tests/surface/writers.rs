//! Files written byte by byte from the descriptions of the formats, independently of the readers.

use std::path::PathBuf;

/// File in a temporary folder, deleted with the folder.
pub struct Written {
    _folder: tempfile::TempDir,
    pub path: PathBuf,
}

pub fn file(name: &str, bytes: impl AsRef<[u8]>) -> Written {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    Written {
        _folder: folder,
        path,
    }
}

/// NPY file, version 1.0.
pub fn npy(descr: &str, fortran: bool, shape: &str, data: &[u8]) -> Vec<u8> {
    let order = if fortran { "True" } else { "False" };
    let mut header =
        format!("{{'descr': '{descr}', 'fortran_order': {order}, 'shape': {shape}, }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(data);
    bytes
}

/// Header of a SUR file.
pub struct Sur<'a> {
    pub bits: i16,
    pub nx: i32,
    pub ny: i32,
    pub lowest: i32,
    pub holes: bool,
    pub spacing: [f32; 2],
    pub step: f32,
    pub offset: f32,
    pub units: [&'a [u8]; 3],
    pub comment: &'a [u8],
}

/// SUR file with points line by line, x fastest.
pub fn sur(about: &Sur, points: &[i32]) -> Vec<u8> {
    let mut bytes = vec![0u8; 512];
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    put(0, b"DIGITAL SURF");
    put(14, &1i16.to_le_bytes());
    put(16, &1i16.to_le_bytes());
    put(18, &2i16.to_le_bytes());
    put(86, &i16::from(about.holes).to_le_bytes());
    put(98, &about.bits.to_le_bytes());
    put(100, &about.lowest.to_le_bytes());
    put(104, &i32::MAX.to_le_bytes());
    put(108, &about.nx.to_le_bytes());
    put(112, &about.ny.to_le_bytes());
    put(116, &(about.nx * about.ny).to_le_bytes());
    put(120, &about.spacing[0].to_le_bytes());
    put(124, &about.spacing[1].to_le_bytes());
    put(128, &about.step.to_le_bytes());
    for (axis, unit) in about.units.iter().enumerate() {
        put(132 + 16 * axis, b"XYZ axis        ");
        put(180 + 16 * axis, b"                ");
        put(180 + 16 * axis, unit);
        put(228 + 16 * axis, b"mm              ");
    }
    put(334, &(about.comment.len() as i16).to_le_bytes());
    put(474, &about.offset.to_le_bytes());
    bytes.extend(about.comment);
    for point in points {
        match about.bits {
            16 => bytes.extend((*point as i16).to_le_bytes()),
            _ => bytes.extend(point.to_le_bytes()),
        }
    }
    bytes
}

/// Description of an X3P file with a matrix `nx` x `ny`. `z` is the content of the CZ element.
pub fn x3p_description(nx: usize, ny: usize, increments: [f64; 2], z: &str, valid: bool) -> String {
    let valid = if valid {
        "<ValidPointsLink>bindata/valid.bin</ValidPointsLink>"
    } else {
        ""
    };
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<!-- a comment -->\n\
         <p:ISO5436_2 xmlns:p=\"http://www.opengps.eu/2008/ISO5436_2\">\n\
         <Record1><Revision>ISO5436 - 2000</Revision><FeatureType> SUR </FeatureType><Axes>\n\
         <CX><AxisType>I</AxisType><DataType>D</DataType><Increment>{:e}</Increment><Offset>1</Offset></CX>\n\
         <CY><AxisType>I</AxisType><DataType>D</DataType><Increment>{:e}</Increment><Offset>2</Offset></CY>\n\
         <CZ><AxisType>A</AxisType>{z}</CZ></Axes></Record1>\n\
         <Record2><Comment/></Record2>\n\
         <Record3><MatrixDimension><SizeX>{nx}</SizeX><SizeY>{ny}</SizeY><SizeZ>1</SizeZ></MatrixDimension>\n\
         <DataLink><PointDataLink>bindata/data.bin</PointDataLink>{valid}</DataLink></Record3>\n\
         <Record4><ChecksumFile>md5checksum.hex</ChecksumFile></Record4></p:ISO5436_2>\n",
        increments[0], increments[1]
    )
}

/// Zip archive with uncompressed members.
pub fn zip(members: &[(&str, &[u8])]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut directory = Vec::new();
    for (name, data) in members {
        let at = bytes.len() as u32;
        // Common part of both kinds of header: from the required version to the length of the extra field.
        let mut common = Vec::new();
        common.extend([20, 0, 0, 0, 0, 0, 0, 0, 0x21, 0]);
        common.extend(crc32(data).to_le_bytes());
        common.extend((data.len() as u32).to_le_bytes());
        common.extend((data.len() as u32).to_le_bytes());
        common.extend((name.len() as u16).to_le_bytes());
        common.extend([0, 0]);
        bytes.extend(b"PK\x03\x04");
        bytes.extend(&common);
        bytes.extend(name.as_bytes());
        bytes.extend(*data);
        directory.extend(b"PK\x01\x02");
        directory.extend([20, 0]);
        directory.extend(&common);
        directory.extend([0; 10]);
        directory.extend(at.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let start = bytes.len() as u32;
    bytes.extend(&directory);
    bytes.extend(b"PK\x05\x06\0\0\0\0");
    bytes.extend((members.len() as u16).to_le_bytes());
    bytes.extend((members.len() as u16).to_le_bytes());
    bytes.extend((directory.len() as u32).to_le_bytes());
    bytes.extend(start.to_le_bytes());
    bytes.extend([0, 0]);
    bytes
}

fn crc32(data: &[u8]) -> u32 {
    !data.iter().fold(!0u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            (crc >> 1) ^ if crc & 1 == 1 { 0xEDB8_8320 } else { 0 }
        })
    })
}
