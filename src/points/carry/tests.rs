use super::*;

#[test]
fn bytes_compare_like_values_and_come_back() {
    let values = [
        f64::NEG_INFINITY,
        -1e9,
        -70000.0,
        -300.0,
        -1.5,
        -1.0,
        0.0,
        1e-9,
        1.0,
        200.0,
        40000.0,
        3e9,
        f64::INFINITY,
    ];
    for scalar in SCALARS {
        let column = Column {
            name: "x".into(),
            scalar,
        };
        let mut last: Option<(f64, Vec<u8>)> = None;
        for value in values {
            let (mut row, mut plain, mut back) = (Vec::new(), Vec::new(), Vec::new());
            put_ordered(scalar, value, &mut row);
            scalar.put(value, &mut plain);
            Carried::unordered(&column, &row, &mut back);
            assert_eq!(plain, back, "{scalar:?} {value}");
            let stored = real(scalar, &plain, false);
            if let Some((before, bytes)) = &last {
                let order = before.partial_cmp(&stored).unwrap();
                assert_eq!(bytes.cmp(&row), order, "{scalar:?} {before} {stored}");
            }
            last = Some((stored, row));
        }
    }
}

#[test]
fn a_common_type_has_all_values() {
    use Scalar::*;
    for (a, b, want) in [
        (U8, U8, U8),
        (U8, U16, U16),
        (U8, I8, I16),
        (U16, I8, I32),
        (U32, I8, F64),
        (F32, U16, F32),
        (F32, I32, F64),
        (F64, U8, F64),
    ] {
        assert_eq!((common(a, b), common(b, a)), (want, want), "{a:?} {b:?}");
    }
}
