use super::*;

fn points(text: &str) -> Vec<[f64; 3]> {
    let dialect = guess(&head("a.txt", text, Layout::default())).unwrap();
    let mut decimals = 0;
    text.as_bytes()[dialect.start as usize..]
        .split(|b| matches!(b, b'\n' | b'\r'))
        .filter_map(|line| match dialect.row(line, &mut decimals) {
            Row::Point(p) => Some(p),
            Row::Wrong(why) => panic!("{why}"),
            Row::Blank | Row::Count(_) => None,
        })
        .collect()
}

#[test]
fn reads_every_way_of_writing() {
    let want = [[1.5, 2.0, -3.25], [4.0, 5.0, 6.0]];
    for text in [
        "1.5 2 -3.25\n4 5 6\n",
        "1.5\t2\t-3.25\r\n4\t5\t6",
        "1.5,2,-3.25\r4,5,6\r",
        "1.5, 2, -3.25, 9\n4, 5, 6, 9\n",
        "1.5;2;-3.25\n4;5;6\n",
        "1,5;2;-3,25\n4;5;6\n",
        "1,5 2 -3,25\n4 5 6\n",
        "# note\n\nX Y Z\n1.5 2 -3.25\n4 5 6\n",
        "//X,Y,Z\n1.5,2,-3.25\n4,5,6\n",
        "\u{feff}1.5 2 -3.25\n4 5 6\n",
        "2\n1.5 2 -3.25 -100 1 2 3\n4 5 6 -100 1 2 3\n",
        "\"z\",\"x\",\"y\"\n-3.25,1.5,2\n6,4,5\n",
        "\"X\",\"Y\",\"Z\"\n1.5 2 -3.25\n4 5 6\n",
    ] {
        assert_eq!(points(text), want, "{text:?}");
    }
}

#[test]
fn comments_name_columns() {
    let names = |text: &str| {
        let dialect = guess(&head("a.txt", text, Layout::default())).unwrap();
        let others = dialect.others.into_iter();
        others
            .map(|(at, column)| format!("{at} {}", column.name))
            .collect::<Vec<_>>()
    };
    let named = ["3 nx", "4 ny", "5 nz"];
    for text in [
        "//X Y Z Nx Ny Nz\n1 2 3 0 0 1\n",
        "//X Y Z Nx Ny Nz\n1\n1 2 3 0 0 1\n",
        "# scan\n\n# x,y,z,Nx,Ny,Nz\n1,2,3,0,0,1\n",
        "X Y Z Nx Ny Nz\n1 2 3 0 0 1\n",
        "//X Y Z Nx Ny Nz\n# note\n1 2 3 0 0 1\n",
    ] {
        assert_eq!(names(text), named, "{text:?}");
    }
    for text in [
        "//X Y Z\n1 2 3 0 0 1\n",
        "# X Y Z are all in metres\n1 2 3 0 0 1\n",
        "1 2 3 0 0 1\n",
    ] {
        assert_eq!(names(text), [""; 0], "{text:?}");
    }
    assert_eq!(
        names("//Nx Ny Nz X Y Z\n1 2 3 0 0 1\n"),
        ["0 nx", "1 ny", "2 nz"]
    );
}

#[test]
fn refuses_what_is_no_list_of_points() {
    for text in [
        "",
        "# only a note\n",
        "some prose here\nand more\n",
        "1 2\n3 4\n",
    ] {
        assert!(
            guess(&head("a.txt", text, Layout::default())).is_err(),
            "{text:?}"
        );
    }
}
