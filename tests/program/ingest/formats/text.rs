//! Text.

use crate::ingest::bench::Bench;
use std::path::PathBuf;

fn write(bench: &Bench, texts: &[&str]) -> Vec<PathBuf> {
    let texts = texts.iter().enumerate();
    texts
        .map(|(number, text)| bench.write(&format!("{number}.txt"), text))
        .collect()
}

pub fn separators(bench: &Bench) -> Vec<PathBuf> {
    let text = "1.5 2 -3\n4 5 6\n";
    let others = ["   ", "\t", ",", ", ", ";"].map(|separator| text.replace(' ', separator));
    let all: Vec<&str> = [text]
        .into_iter()
        .chain(others.iter().map(String::as_str))
        .collect();
    write(bench, &all)
}

pub fn decimal_commas(bench: &Bench) -> Vec<PathBuf> {
    write(bench, &["1,5 2,0 3\n4 5 6,25\n", "1,5;2,0;3\n4;5;6,25\n"])
}

pub fn names(bench: &Bench) -> Vec<PathBuf> {
    write(
        bench,
        &[
            "X Y Z Red\n1 2 3 9\n",
            "\"x [m]\",\"y [m]\",\"z [m]\",\"a, b\"\n1,2,3,4\n",
            "//X,Y,Z\n1,2,3\n",
            "% x y z\n1 2 3\n",
        ],
    )
}

pub fn other_names(bench: &Bench) -> Vec<PathBuf> {
    write(
        bench,
        &[
            "\"id\",\"z\",\"x\",\"y\"\nfirst,1,2,3\n",
            ",x,y,z\n0,1,2,3\n",
            "Northing;Easting;Height\n1,5;2;3\n",
            "\"Points:0\",\"Points:1\",\"Points:2\"\n1,2,3\n",
            "# ID, X, Y, Z, TRACK[]\n1 2 3 4\n2 3 4 5 6 7\n",
        ],
    )
}

pub fn no_names(bench: &Bench) -> Vec<PathBuf> {
    write(
        bench,
        &[
            "1.5 2 -3 9\n4 5 6 9\n",
            "1 2 3 200 100 50\n",
            "1 2 3 -1024 200 100 50\n",
        ],
    )
}

pub fn untold(bench: &Bench) -> Vec<PathBuf> {
    write(
        bench,
        &[
            "a,b,c\n1,2,3\n",
            "id,x,y,z\n1,2,3,4,5,6\n",
            "1,2.5,3.5,4.5,tree\n2,3.5,4.5,5.5,rock\n",
        ],
    )
}

pub fn comments(bench: &Bench) -> Vec<PathBuf> {
    write(
        bench,
        &["# one\n// two\n% three\n\n1 2 3\n# four\n4 5 6\n\n"],
    )
}

pub fn counts(bench: &Bench) -> Vec<PathBuf> {
    write(
        bench,
        &["2\n1 2 3 -100 1 2 3\n4 5 6 -100 1 2 3\n1\n7 8 9 0 0 0 0\n"],
    )
}

pub fn line_ends(bench: &Bench) -> Vec<PathBuf> {
    write(
        bench,
        &[
            "1 2 3\n4 5 6",
            "1 2 3\r\n4 5 6\r\n",
            "1 2 3\r4 5 6\r",
            "\u{feff}1 2 3\n",
        ],
    )
}

pub fn any_name(bench: &Bench) -> Vec<PathBuf> {
    ["a.ply", "a.bin", "a"]
        .map(|name| bench.write(name, "1 2 3\n4 5 6\n"))
        .into()
}

pub fn utf16(bench: &Bench) -> Vec<PathBuf> {
    let words: Vec<u16> = "\u{feff}1 2 3\n".encode_utf16().collect();
    let little: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    let big: Vec<u8> = words.iter().flat_map(|w| w.to_be_bytes()).collect();
    vec![
        bench.write("little.xyz", little),
        bench.write("big.xyz", big),
    ]
}
