//! Files with names of columns.

use super::lines;

/// Files whose names tell where the coordinates are, and what is said about them.
pub fn named() -> Vec<(&'static str, String, &'static str)> {
    let mut files: Vec<(&str, String, &str)> = Vec::new();
    let mut add = |name, header: &str, said, line: &dyn Fn(usize, [f64; 3]) -> String| {
        files.push((name, header.to_owned() + &lines(line), said));
    };
    let livox = "Version,Slot ID,Timestamp Type,Timestamp,X,Y,Z,Reflectivity,Ori_x,Ori_y,Ori_z\n";
    add(
        "livox.csv",
        livox,
        "columns 5–7 \"X Y Z\"; intensity from column 8",
        &|i, [x, y, z]| {
            format!(
                "5,1,0x00,100000{i},{x},{y},{z},{i},{},{},{}\n",
                1000.0 * x,
                1000.0 * y,
                1000.0 * z
            )
        },
    );
    let bare = ",x,y,z,red,green,blue\n";
    add(
        "pandas.csv",
        bare,
        "columns 2–4 \"x y z\"; colours 8 bits from columns 5–7",
        &|i, [x, y, z]| format!("{i},{x},{y},{z},1,{i},3\n"),
    );
    add(
        "pandas.tsv",
        &bare.replace(',', "\t"),
        "columns 2–4 \"x y z\"",
        &|i, [x, y, z]| format!("{i}\t{x}\t{y}\t{z}\t1\t2\t3\n"),
    );
    add(
        "r.txt",
        "\"x\" \"y\" \"z\" \"height above\"\n",
        "columns 2–4 \"x y z\"",
        &|i, [x, y, z]| format!("\"{i}\" {x} {y} {z} 7\n"),
    );
    let survey = "Point,Easting,Northing,Elevation\n";
    add(
        "penzd.csv",
        survey,
        "columns 2–4 \"Easting Northing Elevation\"; ",
        &|i, [x, y, z]| format!("{i},{x},{y},{z},\"TREE, old\"\n"),
    );
    let survey = "Point ID;Northing (m);Easting (m);Height (m);Code\n";
    add(
        "pnezd.csv",
        survey,
        "columns 3, 2, 4 \"Easting (m)\", \"Northing (m)\", \"Height (m)\"",
        &|i, [x, y, z]| {
            let comma = |v: f64| v.to_string().replace('.', ",");
            format!("{i};{};{};{};TREE\n", comma(y), comma(x), comma(z))
        },
    );
    add("enh.txt", "N E H\n", "columns 2, 1, 3 \"E N H\"", &|_,
                                                             [
        x,
        y,
        z,
    ]| {
        format!("{y} {x} {z}\n")
    });
    add(
        "view.csv",
        "\"Intensity\",\"Points:0\",\"Points:1\",\"Points:2\"\n",
        "columns 2–4",
        &|i, [x, y, z]| format!("{i},{x},{y},{z}\n"),
    );
    add(
        "units.csv",
        "Return number,X[m],Y[m],Z[m]\n",
        "columns 2–4 \"X[m] Y[m] Z[m]\"",
        &|i, [x, y, z]| format!("{i},{x},{y},{z}\n"),
    );
    add(
        "quoted.csv",
        "\"M3C2, distance\",\"Z\",\"Y\",\"X\"\n",
        "columns 4, 3, 2 \"X Y Z\"",
        &|i, [x, y, z]| format!("{i},{z},{y},{x}\n"),
    );
    let colmap = "# 3D point list with one line of data per point:\n\
        #   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n\
        # Number of points: 3, mean track length: 2.5\n";
    add(
        "points3D.txt",
        colmap,
        "columns 2–4 \"X Y Z\"; colours 8 bits from columns 5–7",
        &|i, [x, y, z]| format!("{} {x} {y} {z} 1 2 3 0.5{}\n", 7 * i, " 4 5".repeat(i)),
    );
    add(
        "percent.txt",
        "% i x y z\n",
        "columns 2–4 \"x y z\"",
        &|i, [x, y, z]| format!("{i} {x} {y} {z}\n"),
    );
    add(
        "behind.asc",
        "//Nx Ny Nz X Y Z\n",
        "columns 4–6 \"X Y Z\"",
        &|_, [x, y, z]| format!("0 0 1 {x} {y} {z}\n"),
    );
    add(
        "blank.txt",
        "\"Point ID\" \"X (m)\" \"Y (m)\" \"Z (m)\"\n",
        "columns 2–4",
        &|i, [x, y, z]| format!("{i} {x} {y} {z}\n"),
    );
    files
}
