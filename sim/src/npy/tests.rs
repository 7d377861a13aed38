//! Arrays of every type and order, and damaged ones.

use super::*;
use proptest::prelude::*;

fn file(descr: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    raw(
        &format!("{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}\n"),
        data,
    )
}

fn raw(header: &str, data: &[u8]) -> Vec<u8> {
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((header.len() as u16).to_le_bytes());
    out.extend(header.as_bytes());
    out.extend(data);
    out
}

#[test]
fn every_type_and_byte_order_is_read() {
    for (descr, bytes, value) in [
        ("<f8", (-1.5_f64).to_le_bytes().to_vec(), -1.5),
        (">f8", (-1.5_f64).to_be_bytes().to_vec(), -1.5),
        ("<f4", 0.1_f32.to_le_bytes().to_vec(), f64::from(0.1_f32)),
        (">f4", 0.1_f32.to_be_bytes().to_vec(), f64::from(0.1_f32)),
        ("<f2", half::f16::from_f32(0.5).to_le_bytes().to_vec(), 0.5),
        ("|i1", vec![0xfe], -2.0),
        ("<i2", (-300_i16).to_le_bytes().to_vec(), -300.0),
        (">i2", (-300_i16).to_be_bytes().to_vec(), -300.0),
        (">i4", (-70_000_i32).to_be_bytes().to_vec(), -70_000.0),
        ("<i8", (-5_i64).to_le_bytes().to_vec(), -5.0),
        ("|u1", vec![0xfe], 254.0),
        ("<u2", 65_535_u16.to_le_bytes().to_vec(), 65_535.0),
        (">u4", u32::MAX.to_be_bytes().to_vec(), f64::from(u32::MAX)),
        ("|b1", vec![1], 1.0),
    ] {
        let array = parse(&file(&format!("'{descr}'"), "False", "(1,)", &bytes)).unwrap();
        assert_eq!(
            (array.shape.as_slice(), array.values.as_slice()),
            ([1].as_slice(), [value].as_slice()),
            "{descr}"
        );
    }
}

#[test]
fn fortran_order_becomes_c_order() {
    // numpy.arange(6).reshape(2, 3) stored by columns.
    let array = parse(&file("'|u1'", "True", "(2, 3)", &[0, 3, 1, 4, 2, 5])).unwrap();
    assert_eq!(
        (array.shape, array.values),
        (vec![2, 3], vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    );
    let cube = parse(&file("'|u1'", "True", "(2, 2, 2)", &[0, 4, 2, 6, 1, 5, 3, 7])).unwrap();
    assert_eq!(cube.values, (0..8).map(f64::from).collect::<Vec<_>>());
}

#[test]
fn a_file_as_numpy_writes_it_is_the_file_that_is_written() {
    // numpy.save of numpy.array([[1, 2, 3]], 'f4'), NumPy 1.26.
    let mut expected = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    expected.extend(b"{'descr': '<f4', 'fortran_order': False, 'shape': (1, 3), }");
    expected.resize(127, b' ');
    expected.push(b'\n');
    for v in [1.0_f32, 2.0, 3.0] {
        expected.extend(v.to_le_bytes());
    }
    let mut out = Vec::new();
    write(&mut out, &[1, 3], &[1.0_f32, 2.0, 3.0]).unwrap();
    assert_eq!(out, expected);
    assert!(write(&mut Vec::new(), &[2, 3], &[1.0_f32]).is_err());
    for shape in [vec![], vec![5], vec![1, 2, 3], vec![1; 30]] {
        let head = header::<f64>(&shape);
        assert_eq!(head.len() % 64, 0);
        let mut bytes = head;
        bytes.resize(bytes.len() + 64 * 8, 0);
        assert_eq!(parse(&bytes).unwrap().shape, shape);
    }
}

#[test]
fn damaged_and_hostile_files_are_refused_by_name() {
    let message = |bytes: &[u8]| parse(bytes).unwrap_err().to_string();
    let good = file("'<f4'", "False", "(2,)", &[0; 8]);
    assert!(message(b"").contains("not a .npy array"));
    assert!(message(b"name = 'pond'").contains("not a .npy array"));
    assert!(message(b"\x93NUMPY\x09\x00..").contains("version 9.0"));
    assert!(message(&good[..good.len() - 1]).contains("needs 8 bytes after its header, the file has 7"));
    assert!(message(&good[..20]).contains("expected the rest of the header"));
    assert!(message(b"\x93NUMPY\x02\x00\xff\xff\xff\xff").contains("at most 64 KiB"));
    assert!(message(&file("'<f4'", "False", "(4294967296, 4294967296)", &[])).contains("exceeds the limit"));
    assert!(message(&file("'<f4'", "False", "(99999999999999999999999,)", &[])).contains("whole number"));
    assert!(message(&file("'<f4'", "False", "(-1,)", &[])).contains("whole number"));
    assert!(message(&file("[('x', '<f4')]", "False", "(1,)", &[])).contains("[('x', '<f4')]"));
    assert!(message(&file("'<c8'", "False", "(1,)", &[])).contains("'<c8'"));
    assert!(message(&file("'|O'", "False", "(1,)", &[])).contains("not plain numbers"));
    assert!(message(&file("'<f4'", "Maybe", "(1,)", &[])).contains("True or False"));
    assert!(message(&raw("{'descr': '<f4'}", &[])).contains("the keys"));
    assert!(message(&raw("{'descr: ", &[])).contains("a text that ends"));
}

proptest! {
    #[test]
    fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = parse(&bytes);
        let mut begun = b"\x93NUMPY\x01\x00".to_vec();
        begun.extend(bytes);
        let _ = parse(&begun);
    }

    #[test]
    fn mutated_files_are_read_or_refused(at in 0_usize..160, byte: u8) {
        let mut bytes = Vec::new();
        write(&mut bytes, &[2, 3], &[1.0_f32, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
        let at = at % bytes.len();
        bytes[at] = byte;
        if let Ok(array) = parse(&bytes) {
            prop_assert_eq!(array.shape.iter().product::<usize>(), array.values.len());
        }
    }

    #[test]
    fn what_is_written_is_read(values in proptest::collection::vec(any::<f64>(), 0..50)) {
        let mut bytes = Vec::new();
        write(&mut bytes, &[values.len()], &values).unwrap();
        let read = parse(&bytes).unwrap();
        let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        prop_assert_eq!(bits(&read.values), bits(&values));
    }
}
