use super::*;

#[test]
fn normals_have_many_names() {
    let columns = |names: &[&str]| -> Vec<Column> {
        let columns = names.iter().map(|name| Column::new(name, Scalar::F32));
        columns.collect()
    };
    for (names, expected) in [
        (&["red", "NX", "Ny", "nz"][..], Some([1, 2, 3])),
        (&["normal_z", "normal_x", "normal_y"], Some([1, 2, 0])),
        (
            &["nor_normalX", "nor_normalY", "nor_normalZ"],
            Some([0, 1, 2]),
        ),
        (&["NormalX", "NormalY", "NormalZ", "nx"], Some([0, 1, 2])),
        (&["scalar_Nx", "scalar_Ny", "scalar_Nz"], Some([0, 1, 2])),
        (&["nx", "ny", "normalz"], None),
        (&[], None),
    ] {
        assert_eq!(normal_columns(&columns(names)), expected, "{names:?}");
    }
}

#[test]
fn lists_are_parsed() {
    let list = |names: &[&str]| {
        Ok(Attributes::List(
            names.iter().map(|n| (*n).to_owned()).collect(),
        ))
    };
    assert_eq!("none".parse(), Ok(Attributes::None));
    assert_eq!(" auto".parse(), Ok(Attributes::Auto));
    assert_eq!(
        "Colour, class,red".parse(),
        list(&["red", "green", "blue", "classification"])
    );
    assert_eq!("scalar_Intensity".parse(), list(&["intensity"]));
    for wrong in ["", ",", "color,,intensity"] {
        assert!(wrong.parse::<Attributes>().is_err(), "{wrong}");
    }
}

#[test]
fn of_two_columns_of_a_name_the_first_counts() {
    let columns = ["red", "x2", "Red", "intensity"].map(|n| Column::new(n, Scalar::U8));
    assert_eq!(Attributes::Auto.of(&columns), [0, 3]);
    let wanted = Attributes::List(vec!["x2".into(), "y2".into()]);
    assert_eq!(wanted.of(&columns), [1]);
    assert!(wanted.check(&columns).is_err());
    assert!(Attributes::Auto.check(&[]).is_ok());
}

#[test]
fn rows_are_not_wider_than_allowed() {
    let columns: Vec<Column> = (0..9)
        .map(|n| Column::new(&n.to_string(), Scalar::F64))
        .collect();
    let list = |n: usize| Attributes::List((0..n).map(|n| n.to_string()).collect());
    assert_eq!(
        Wanted::of(&list(6), &columns, Also::default())
            .unwrap()
            .bytes(),
        48
    );
    assert!(Wanted::of(&list(7), &columns, Also::default()).is_err());
}

#[test]
fn scanners_are_wanted_beside_others() {
    let columns = ["intensity", SCANNER, "red"].map(|n| Column::new(n, Scalar::U16));
    let numbers = |attributes: &Attributes, scanners| {
        let also = Also {
            scanners,
            ..Also::default()
        };
        Wanted::of(attributes, &columns, also).unwrap().numbers
    };
    assert_eq!(numbers(&Attributes::None, true), [1]);
    assert_eq!(numbers(&Attributes::Auto, true), [0, 1, 2]);
    assert_eq!(numbers(&Attributes::Auto, false), [0, 2]);
    let listed = Attributes::List(vec![SCANNER.into()]);
    assert_eq!(numbers(&listed, true), numbers(&listed, false));
}
