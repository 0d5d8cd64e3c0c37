//! Tables: valid contents, and files that reproduce the table and its schema bit by bit.

use arrow_array::{Float64Array, RecordBatch};
use arrow_schema::{DataType, Field};
use bytes::Bytes;
use fretwear::tables::{
    Column, ColumnType, METADATA_KEY, Provenance, Schema, Table, TableBuilder, TableError,
    TableLocation, TableName, from_parquet, provenance_of, to_parquet,
};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::basic::{Compression, CompressionCodec, Encoding, GzipLevel};
use parquet::file::metadata::{ParquetMetaDataReader, ParquetMetaDataWriter};
use parquet::file::properties::WriterProperties;
use proptest::prelude::*;
use std::sync::Arc;

fn provenance() -> Provenance {
    Provenance {
        scene_hash: "5ce9e".to_owned(),
        program_version: "0.1.0".to_owned(),
    }
}

/// Table of any schema with all columns and `rows` rows, unless the schema fixes the number of rows.
fn filled(table: TableName, rows: usize) -> Table {
    let schema = table.schema();
    let rows = schema.rows.unwrap_or(rows);
    schema
        .columns
        .iter()
        .enumerate()
        .fold(Table::builder(table), |builder, (number, column)| {
            let seed = number as f64 + 0.25;
            let values: Column = match column.kind {
                ColumnType::F64 => (0..rows)
                    .map(|row| {
                        if column.sparse && row % 3 > 0 {
                            0.0
                        } else {
                            seed * row as f64
                        }
                    })
                    .collect::<Vec<f64>>()
                    .into(),
                ColumnType::MaybeF64 => (0..rows)
                    .map(|row| (row % 4 > 0).then_some(seed * row as f64))
                    .collect::<Vec<Option<f64>>>()
                    .into(),
                ColumnType::I32 => (0..rows).map(|row| row as i32).collect::<Vec<i32>>().into(),
                ColumnType::I64 => (0..rows).map(|row| row as i64).collect::<Vec<i64>>().into(),
                ColumnType::Bool => (0..rows)
                    .map(|row| row % 2 > 0)
                    .collect::<Vec<bool>>()
                    .into(),
                ColumnType::Text => (0..rows)
                    .map(|row| format!("stage {row}"))
                    .collect::<Vec<String>>()
                    .into(),
            };
            builder.column(&column.name, values)
        })
        .build()
        .expect("all columns of the schema")
}

fn hysteresis(load: Vec<f64>) -> Table {
    let displacement = vec![1e-6; load.len()];
    Table::builder(TableName::Hysteresis)
        .column("load", load)
        .column("displacement", displacement)
        .build()
        .expect("two columns of one length")
}

/// Allowed unit symbols. A new symbol must be added here.
const UNITS: [&str; 21] = [
    "1", "B", "m", "m^2", "m^3", "Pa", "N", "N m", "N/m", "m/N", "m s^2/N", "J", "J/m^2", "s",
    "Hz", "1/s", "1/s^2", "rad", "kg", "kg^-1/2", "as named",
];

#[test]
fn every_schema_file_is_built_in_and_complete() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/schemas");
    let mut stems: Vec<String> = std::fs::read_dir(folder)
        .expect("schemas/")
        .map(|entry| entry.expect("an entry").path())
        // The folder also contains the build script that generates types.
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .map(|path| {
            path.file_stem()
                .expect("a stem")
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    stems.sort();
    let mut built_in: Vec<&str> = TableName::ALL.iter().map(|table| table.as_str()).collect();
    built_in.sort_unstable();
    assert_eq!(stems, built_in);
    for table in TableName::ALL {
        assert_eq!(TableName::from_name(table.as_str()), Some(table));
        assert!(table.source().contains(&format!("name = \"{table}\"")));
        for column in &table.schema().columns {
            let name = format!("{table}.{}", column.name);
            assert!(
                UNITS.contains(&column.unit.as_str()),
                "{name}: {}",
                column.unit
            );
            assert!(column.description.ends_with('.'), "{name}");
            assert!(!column.dimension.is_empty(), "{name}");
            assert!(!column.sparse || column.kind == ColumnType::F64, "{name}");
            assert_ne!(
                column.name, "wear_iteration",
                "the key of the folder must not be a column"
            );
        }
    }
}

/// A history joins the columns of the one-row tables. Columns of the summary keep their names, and other columns get the prefix of their
/// table.
#[test]
fn the_columns_of_a_history_have_names_of_their_own() {
    let own = ["wear_iteration", "commit", "pruned", "bytes"];
    let mut names = std::collections::BTreeSet::from(own.map(str::to_owned));
    for table in TableName::ALL {
        let schema = table.schema();
        if schema.place != TableLocation::Iteration || schema.rows != Some(1) {
            continue;
        }
        for column in &schema.columns {
            let name = match table {
                TableName::Summary => column.name.clone(),
                table => format!("{table}_{}", column.name),
            };
            assert!(!name.starts_with("timing_"), "{name}");
            assert!(names.insert(name.clone()), "{name} twice");
        }
    }
}

#[test]
fn every_file_says_its_units_and_one_beside_runs_what_its_columns_mean() {
    for table in TableName::ALL {
        let bytes = to_parquet(&filled(table, 21), &provenance()).expect("a file");
        let reader = ParquetRecordBatchReaderBuilder::try_new(Bytes::from(bytes)).expect("Parquet");
        let key_values = reader
            .metadata()
            .file_metadata()
            .key_value_metadata()
            .expect("metadata of the file");
        let text = key_values
            .iter()
            .find(|entry| entry.key == METADATA_KEY)
            .and_then(|entry| entry.value.clone())
            .expect("the entry of the program");
        let entry: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(entry["schema"], table.as_str());
        assert_eq!(entry["scene_hash"], "5ce9e");
        assert_eq!(entry["program_version"], "0.1.0");
        let columns = &table.schema().columns;
        assert_eq!(reader.schema().fields().len(), columns.len());
        for (column, field) in columns.iter().zip(reader.schema().fields()) {
            assert_eq!(field.name(), &column.name);
            assert_eq!(field.is_nullable(), column.kind == ColumnType::MaybeF64);
            let name = format!("{table}.{}", column.name);
            assert_eq!(field.metadata().get("unit"), Some(&column.unit), "{name}");
            let entry = &entry["columns"][&column.name];
            assert_eq!(entry["unit"], column.unit, "{name}");
            // The file `schemas.json` of a run contains these texts once.
            let beside = table.schema().place == TableLocation::Beside;
            for (key, expected) in [
                ("dimension", &column.dimension),
                ("description", &column.description),
            ] {
                let expected = beside.then_some(expected.as_str());
                assert_eq!(entry[key].as_str(), expected, "{name}");
            }
        }
    }
}

#[test]
fn encodings_are_those_of_the_schema() {
    for table in TableName::ALL {
        let bytes = to_parquet(&filled(table, 21), &provenance()).expect("a file");
        let reader = ParquetRecordBatchReaderBuilder::try_new(Bytes::from(bytes)).expect("Parquet");
        let group = reader.metadata().row_group(0);
        for (column, chunk) in table.schema().columns.iter().zip(group.columns()) {
            let name = format!("{table}.{}", column.name);
            let compressed = matches!(chunk.compression(), Compression::ZSTD(_));
            assert_eq!(compressed, table.schema().rows != Some(1), "{name}");
            assert!(chunk.dictionary_page_offset().is_none(), "{name}");
            let split = chunk
                .encodings()
                .any(|encoding| encoding == Encoding::BYTE_STREAM_SPLIT);
            let dense = column.kind == ColumnType::F64 && !column.sparse;
            assert_eq!(split, dense, "{name}");
        }
    }
}

#[test]
fn a_table_comes_back_as_it_was() {
    for table in TableName::ALL {
        let written = filled(table, 77);
        let bytes = to_parquet(&written, &provenance()).expect("a file");
        let read = from_parquet(&bytes, table.schema()).expect("the table");
        assert_eq!(read, written);
        assert_eq!(
            provenance_of(&bytes, table.schema()).expect("an entry"),
            provenance()
        );
    }
}

#[test]
fn a_table_without_rows_comes_back() {
    let bytes = to_parquet(&hysteresis(Vec::new()), &provenance()).expect("a file");
    let read = from_parquet(&bytes, TableName::Hysteresis.schema()).expect("the table");
    assert_eq!(read.rows(), 0);
    assert_eq!(read.f64("load").expect("a column"), &[] as &[f64]);
}

#[test]
fn a_table_longer_than_a_batch_comes_back() {
    let load: Vec<f64> = (0..150_001).map(|row| (row as f64).sin()).collect();
    let bytes = to_parquet(&hysteresis(load.clone()), &provenance()).expect("a file");
    let read = from_parquet(&bytes, TableName::Hysteresis.schema()).expect("the table");
    assert_eq!(read.f64("load").expect("a column"), load);
}

proptest! {
    #[test]
    fn floats_come_back_bit_for_bit(bits in prop::collection::vec(any::<u64>(), 1..200)) {
        let mut load: Vec<f64> = bits.into_iter().map(f64::from_bits).filter(|v| v.is_finite()).collect();
        load.extend([0.0, -0.0, f64::MIN_POSITIVE, f64::MIN_POSITIVE / 8.0, -5e-324, f64::MAX]);
        let bytes = to_parquet(&hysteresis(load.clone()), &provenance()).expect("a file");
        prop_assert_eq!(&bytes, &to_parquet(&hysteresis(load.clone()), &provenance()).expect("a file"));
        let read = from_parquet(&bytes, TableName::Hysteresis.schema()).expect("the table");
        let read: Vec<u64> = read.f64("load").expect("a column").iter().map(|v| v.to_bits()).collect();
        let written: Vec<u64> = load.iter().map(|v| v.to_bits()).collect();
        prop_assert_eq!(read, written);
    }

    #[test]
    fn integers_come_back(n_cycles in any::<i64>(), rejected in any::<i64>()) {
        let table = Table::builder(TableName::WearStep)
            .column("n_cycles", vec![n_cycles])
            .column("rejected", vec![rejected])
            .column("volume", vec![1e-12])
            .column("error", vec![0.0])
            .column("next_n_cycles", vec![n_cycles as f64])
            .column("fft_pairs", vec![12.5])
            .build()
            .expect("all columns");
        let bytes = to_parquet(&table, &provenance()).expect("a file");
        prop_assert_eq!(from_parquet(&bytes, TableName::WearStep.schema()).expect("the table"), table);
    }

    #[test]
    fn texts_come_back(stages in prop::collection::vec("\\PC{0,12}", 1..50)) {
        let table = Table::builder(TableName::Timing)
            .column("seconds", vec![0.5; stages.len()])
            .column("fft_pairs", vec![12.5; stages.len()])
            .column("cpu_seconds", vec![None; stages.len()])
            .column("stage", stages)
            .build()
            .expect("four columns");
        let bytes = to_parquet(&table, &provenance()).expect("a file");
        prop_assert_eq!(from_parquet(&bytes, TableName::Timing.schema()).expect("the table"), table);
    }
}

#[test]
fn optional_columns_may_be_left_out_and_others_may_not() {
    let cells = || (vec![0, 0, 1], vec![0, 1, 0]);
    let (i, j) = cells();
    let table = Table::builder(TableName::ContactField)
        .column("pressure", vec![0.0, 2e6, 0.0])
        .column("i", i)
        .column("j", j)
        .optional_column("shear_x", Some(vec![0.0, 1e5, 0.0]))
        .optional_column("shear_y", None::<Vec<f64>>)
        .column("gap", vec![1e-6, 0.0, 2e-6])
        .build()
        .expect("required columns are there");
    let names: Vec<&str> = table
        .columns()
        .map(|(column, _)| column.name.as_str())
        .collect();
    assert_eq!(names, ["i", "j", "gap", "pressure", "shear_x"]);
    assert!(table.has("shear_x") && !table.has("shear_y"));
    assert!(matches!(
        table.f64("shear_y"),
        Err(TableError::MissingColumn { column, .. }) if column == "shear_y"
    ));
    assert!(matches!(table.f64("i"), Err(TableError::ColumnType { .. })));
    assert_eq!(table.i32("i").expect("a column"), [0, 0, 1]);
    let bytes = to_parquet(&table, &provenance()).expect("a file");
    let read = from_parquet(&bytes, TableName::ContactField.schema()).expect("the table");
    assert_eq!(read, table);

    let (i, j) = cells();
    let error = Table::builder(TableName::ContactField)
        .column("i", i)
        .column("j", j)
        .column("gap", vec![0.0; 3])
        .build()
        .expect_err("no pressure");
    assert!(matches!(&error, TableError::MissingColumn { column, .. } if column == "pressure"));
}

#[test]
fn what_breaks_the_schema_is_named() {
    let curve = || Table::builder(TableName::Indentation).column("load", vec![1.0, 2.0]);
    let text = |builder: TableBuilder| builder.build().expect_err("broken").to_string();

    let unknown = text(curve().column("displacment", vec![0.0, 0.0]));
    assert!(
        unknown.contains("displacment") && unknown.contains("load, displacement"),
        "{unknown}"
    );
    let length = text(curve().column("displacement", vec![0.0; 3]));
    assert!(
        length.contains("3 rows") && length.contains("have 2"),
        "{length}"
    );
    let kind = text(curve().column("displacement", vec![1i64, 2]));
    assert!(kind.contains("i64") && kind.contains("f64"), "{kind}");
    let twice = text(curve().column("load", vec![0.0, 0.0]));
    assert!(
        twice.contains("`load`") && twice.contains("twice"),
        "{twice}"
    );
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let error = curve()
            .column("displacement", vec![0.0, bad])
            .build()
            .expect_err("not a number");
        assert!(
            matches!(&error, TableError::NotFinite { column, row: 1, .. } if column == "displacement"),
            "{error}"
        );
    }
}

#[test]
fn only_a_stiffness_may_be_infinite_and_only_positive() {
    let summary = |kn: f64, rq: f64| {
        TableName::Summary
            .schema()
            .columns
            .iter()
            .filter(|column| !column.optional || ["kn", "rq"].contains(&column.name.as_str()))
            .fold(
                Table::builder(TableName::Summary),
                |builder, column| match (column.kind, column.name.as_str()) {
                    (ColumnType::I64, name) => builder.column(name, vec![7i64]),
                    (_, "kn") => builder.column("kn", vec![kn]),
                    (_, "rq") => builder.column("rq", vec![rq]),
                    (_, name) => builder.column(name, vec![0.5]),
                },
            )
            .build()
    };
    assert!(summary(f64::INFINITY, 1e-6).is_ok());
    assert!(summary(f64::NEG_INFINITY, 1e-6).is_err());
    assert!(summary(f64::NAN, 1e-6).is_err());
    assert!(summary(1e9, f64::INFINITY).is_err());
    let table = summary(f64::INFINITY, 1e-6).expect("a table");
    let bytes = to_parquet(&table, &provenance()).expect("a file");
    let read = from_parquet(&bytes, TableName::Summary.schema()).expect("the table");
    assert_eq!(read.f64("kn").expect("a column"), [f64::INFINITY]);
}

#[test]
fn a_summary_has_one_row() {
    let schema = TableName::Summary.schema();
    let error = schema
        .columns
        .iter()
        .filter(|column| !column.optional)
        .fold(
            Table::builder(TableName::Summary),
            |builder, column| match column.kind {
                ColumnType::I64 => builder.column(&column.name, vec![7i64, 8]),
                _ => builder.column(&column.name, vec![0.5, 0.6]),
            },
        )
        .build()
        .expect_err("two rows");
    assert!(
        matches!(
            error,
            TableError::Rows {
                found: 2,
                expected: 1,
                ..
            }
        ),
        "{error}"
    );
}

fn leaked(text: &str) -> &'static Schema {
    Box::leak(Box::new(Schema::parse(text).expect("a schema")))
}

#[test]
fn another_table_or_unit_is_refused_by_name() {
    let source = TableName::Hysteresis.source();
    let bytes = to_parquet(&hysteresis(vec![1.0, -1.0]), &provenance()).expect("a file");

    let error = from_parquet(&bytes, TableName::Indentation.schema()).expect_err("another table");
    assert!(matches!(error, TableError::OtherTable { .. }), "{error}");

    let other_unit = leaked(&source.replace("unit = \"m\"", "unit = \"mm\""));
    let error = from_parquet(&bytes, other_unit).expect_err("another unit");
    assert!(
        matches!(&error, TableError::Unit { found, expected, .. } if found == "m" && expected == "mm"),
        "{error}"
    );
}

#[test]
fn files_of_others_are_refused() {
    let error =
        from_parquet(b"PAR1 nothing PAR1", TableName::Hysteresis.schema()).expect_err("no Parquet");
    assert!(matches!(error, TableError::Parquet { .. }), "{error}");

    let schema = Arc::new(arrow_schema::Schema::new(vec![Field::new(
        "load",
        DataType::Float64,
        false,
    )]));
    let column = Arc::new(Float64Array::from(vec![1.0]));
    let batch = RecordBatch::try_new(schema.clone(), vec![column]).expect("a batch");
    let mut writer = ArrowWriter::try_new(Vec::new(), schema, None).expect("a writer");
    writer.write(&batch).expect("written");
    let bytes = writer.into_inner().expect("a file");
    let error = from_parquet(&bytes, TableName::Hysteresis.schema()).expect_err("not ours");
    assert!(matches!(error, TableError::NotOurs { .. }), "{error}");
}

#[test]
fn a_broken_schema_text_is_refused() {
    let source = TableName::Hysteresis.source();
    assert!(Schema::parse(&source.replace("dimension", "dimensoin")).is_err());
    let twice = source.replace("name = \"displacement\"", "name = \"load\"");
    assert!(matches!(
        Schema::parse(&twice),
        Err(TableError::SchemaColumnTwice { column, .. }) if column == "load"
    ));
}

/// Largest file size \[B\] by the design, for cumulative wear at 256 x 256 cells with about a tenth of the cells worn.
const WEAR_FIELD_BYTES: usize = 120_000;

#[test]
fn a_sparse_field_is_small() {
    let (nx, ny) = (256, 250);
    let cell = |index: usize| (index / ny, index % ny);
    // Islands of contact in about 8 % of the cells.
    let worn: Vec<f64> = (0..nx * ny)
        .map(|index| {
            let (i, j) = cell(index);
            ((0.21 * i as f64).sin() * (0.17 * j as f64).sin() - 0.7).max(0.0) * 1e-6
        })
        .collect();
    let share = worn.iter().filter(|&&depth| depth > 0.0).count() as f64 / worn.len() as f64;
    assert!((0.05..0.15).contains(&share), "{share}");
    let table = Table::builder(TableName::WearField)
        .column(
            "i",
            (0..nx * ny).map(|k| cell(k).0 as i32).collect::<Vec<_>>(),
        )
        .column(
            "j",
            (0..nx * ny).map(|k| cell(k).1 as i32).collect::<Vec<_>>(),
        )
        .column("wear_depth", worn)
        .build()
        .expect("a field");
    let bytes = to_parquet(&table, &provenance()).expect("a file");
    assert!(bytes.len() < WEAR_FIELD_BYTES, "{} bytes", bytes.len());
}

/// Table that another program read and wrote again, with its metadata.
fn written_again(bytes: &[u8], compression: Compression) -> Vec<u8> {
    let reader =
        ParquetRecordBatchReaderBuilder::try_new(Bytes::copy_from_slice(bytes)).expect("a table");
    let schema = reader.schema().clone();
    let beside = reader
        .metadata()
        .file_metadata()
        .key_value_metadata()
        .cloned();
    let properties = WriterProperties::builder()
        .set_compression(compression)
        .set_key_value_metadata(beside)
        .build();
    let mut writer = ArrowWriter::try_new(Vec::new(), schema, Some(properties)).expect("a writer");
    for batch in reader.build().expect("batches") {
        writer.write(&batch.expect("a batch")).expect("written");
    }
    writer.into_inner().expect("a file")
}

#[test]
fn files_of_every_compression() {
    let table = filled(TableName::Cycle, 7);
    let bytes = to_parquet(&table, &provenance()).expect("a file");
    for compression in [
        Compression::UNCOMPRESSED,
        Compression::SNAPPY,
        Compression::GZIP(GzipLevel::default()),
        Compression::LZ4,
        Compression::LZ4_RAW,
    ] {
        let again = written_again(&bytes, compression);
        let read = from_parquet(&again, TableName::Cycle.schema()).expect("the table");
        assert_eq!(read, table, "{compression}");
    }
}

#[test]
fn files_that_announce_what_is_not_read() {
    let table = filled(TableName::Hysteresis, 7);
    let bytes = to_parquet(&table, &provenance()).expect("a file");
    let metadata = ParquetMetaDataReader::new()
        .parse_and_finish(&Bytes::copy_from_slice(&bytes))
        .expect("a description");
    let announcing = |rows: i64, codec: CompressionCodec| {
        let group = metadata.row_group(0).clone();
        let columns = group.columns().iter().map(|column| {
            let builder = column.clone().into_builder();
            builder
                .set_compression_codec(codec)
                .build()
                .expect("a column")
        });
        let columns: Vec<_> = columns.collect();
        let builder = group.into_builder().set_num_rows(rows);
        let group = builder.set_column_metadata(columns).build().expect("rows");
        let changed = metadata.clone().into_builder().set_row_groups(vec![group]);
        let mut found = bytes[..4].to_vec();
        ParquetMetaDataWriter::new(&mut found, &changed.build())
            .finish()
            .expect("a description");
        found
    };
    let refused =
        |bytes: &[u8]| from_parquet(bytes, TableName::Hysteresis.schema()).expect_err("not read");
    let error = refused(&announcing(1 << 40, CompressionCodec::ZSTD));
    assert!(matches!(error, TableError::TooManyRows { .. }), "{error}");
    let text = error.to_string();
    assert!(
        text.contains("1099511627776 rows") && text.contains("268435456"),
        "{text}"
    );
    let error = refused(&announcing(7, CompressionCodec::LZO));
    let text = error.to_string();
    assert!(
        text.ends_with(
            "compressed as LZO; read are UNCOMPRESSED, SNAPPY, GZIP, LZ4, LZ4_RAW, ZSTD"
        ),
        "{text}"
    );
}

/// Copy of the bytes with some flipped bytes or a truncated end. `number` is the seed.
fn damaged(bytes: &[u8], number: u64) -> Vec<u8> {
    let mut state = number;
    // Generator of Steele, Lea & Flood (SplitMix64).
    let mut random = |below: usize| {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % below as u64) as usize
    };
    let mut found = bytes.to_vec();
    if random(8) == 0 {
        found.truncate(random(bytes.len()));
        return found;
    }
    // Damage of the metadata at the end of the file has the largest effect.
    let near_end = random(2) == 0;
    for _ in 0..=random(4) {
        let end = found.len();
        let place = if near_end {
            end - 1 - random(end.min(700))
        } else {
            random(end)
        };
        found[place] = random(256) as u8;
    }
    found
}

/// For any damage, the result is a table or an error.
#[test]
fn damaged_files() {
    for name in [TableName::Summary, TableName::Cycle, TableName::Timing] {
        let whole = to_parquet(&filled(name, 40), &provenance()).expect("a file");
        let again = written_again(&whole, Compression::SNAPPY);
        let mut refused = 0;
        for bytes in [&whole, &again] {
            for number in 0..700 {
                let bytes = damaged(bytes, number);
                refused += usize::from(from_parquet(&bytes, name.schema()).is_err());
                drop(provenance_of(&bytes, name.schema()));
            }
        }
        assert!(refused > 700, "{name}: {refused}");
    }
}
